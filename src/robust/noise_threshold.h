#pragma once

#include "robust/ransac.h"

namespace mono_pose_tracker {

/// The threshold for the last refinement of a model: beyond it lie 0.27 % of the correct data (three standard
/// deviations of a single error), if that is larger than the threshold (radians) of the score. A threshold of
/// two standard deviations cuts off the most informative correct data: the model's deviation grows by a
/// sixth, and by a third if an error has two components. components: 1 for the distance to a line, 2 for that
/// to a point; parameters: those of the model, which has been refined.
double noise_threshold(const RansacScore& score, int num_data, double threshold, int components,
                       int parameters);

}  // namespace mono_pose_tracker
