#pragma once

#include <cstdint>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

/// kAll is for a guess that may have most of the pairs behind the cameras and would have none to go by.
enum class PairsThatCount { kInFront, kAll };

/// Levenberg-Marquardt on rotation and direction of translation (5 parameters) over the truncated squares of
/// the Sampson errors; pairs beyond the threshold or behind a camera at an iteration have no say in it.
/// Returns the truncated cost reached, which is that of score_two_views where the pairs in front count.
double refine_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model,
                        PairsThatCount which = PairsThatCount::kInFront);

/// Leaves local minima of the truncated cost: refines from where so many random samples of the inliers lead,
/// and keeps what costs least (the inner sampling of Chum, Matas and Kittler 2003). With 0 samples it is
/// refine_two_views.
void explore_two_views(const BearingPairs& pairs, double threshold, int samples, std::uint64_t seed,
                       TwoViewModel* model);

/// refine_two_views with a threshold of three standard deviations of the errors, if that is more: one of two
/// cuts off a twentieth of the good pairs, the ones that say most, and with them a sixth of the precision.
void polish_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model);

}  // namespace mono_pose_tracker
