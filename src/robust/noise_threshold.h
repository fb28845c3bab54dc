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

/// Whether noise explains how many data lie between the threshold and `wide`, which is noise_threshold for
/// errors of two components: at most this number of standard deviations more than expected. Otherwise
/// outliers, or correct data that the drift of a map displaces, are among them. num_data: all up to `wide`.
bool noise_explains(int num_beyond, int num_data, double threshold, double wide, double deviations = 2);

}  // namespace mono_pose_tracker
