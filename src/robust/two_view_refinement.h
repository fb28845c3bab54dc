#pragma once

#include <cstdint>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

/// kAll is for a guess that may have most of the pairs behind the cameras and would have none to go by.
enum class PairsThatCount { kInFront, kAll };

/// Levenberg-Marquardt on rotation and direction of translation (5 parameters) over the truncated squared
/// Sampson errors. Pairs beyond the threshold or behind a camera are excluded from each iteration. Returns
/// the truncated cost, which equals that of score_two_views where the pairs in front count.
double refine_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model,
                        PairsThatCount which = PairsThatCount::kInFront);

/// Escapes local minima of the truncated cost: refines from this many random samples of the inliers and keeps
/// the solution with the lowest cost (inner sampling of Chum, Matas and Kittler 2003). With 0 samples it is
/// refine_two_views.
void explore_two_views(const BearingPairs& pairs, double threshold, int samples, std::uint64_t seed,
                       TwoViewModel* model);

/// refine_two_views with the threshold that the errors' noise suggests.
void polish_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model);

}  // namespace mono_pose_tracker
