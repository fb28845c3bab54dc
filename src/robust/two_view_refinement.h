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

/// Inner samples of explore_two_views.
struct InnerSamplingOptions {
  int sample_size = 25;        // of the inliers, at most half: more would lead to where the model is already
  int least_sample_size = 8;   // with fewer nothing is sampled
  int sample_iterations = 4;   // of the refinement with a sample
  int iterations = 25;         // of the refinement with all pairs
  double all_count = 0.4;      // rad, the threshold for a sample: as good as none
  int most_in_vain = 4;        // samples in a row without a lower cost: there is only one minimum nearby
  double min_decrease = 1e-5;  // relative; less is the same minimum
};

/// Escapes local minima of the truncated cost: refines from this many random samples of the inliers and keeps
/// the solution with the lowest cost (inner sampling of Chum, Matas and Kittler 2003). With 0 samples it is
/// refine_two_views.
void explore_two_views(const BearingPairs& pairs, double threshold, int samples, std::uint64_t seed,
                       TwoViewModel* model, const InnerSamplingOptions& options = {});

/// refine_two_views with the threshold that the errors' noise suggests.
void polish_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model);

}  // namespace mono_pose_tracker
