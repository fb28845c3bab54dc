#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Feature `feature` of an image as an observation of point `point` by camera `camera`.
BundleObservation make_observation(int camera, int point, const ImageFeatures& image, int feature);

/// Bundle adjustment of the given keyframes and all their landmarks. At most max_fixed other keyframes that
/// observe these landmarks stay fixed and define the gauge (those with the most observations). The cameras
/// are adjusted with max_landmarks of each free keyframe, those with the most observations, distributed over
/// its image: they constrain the poses best and converge fastest. The other landmarks, and those with one
/// observation in the problem, are adjusted afterwards with the cameras fixed. Not usable: the map is
/// unchanged. The loss width is options.loss_width times the spread of the residuals (median), so that sharp
/// images get a narrower loss than blurred ones.
BundleReport adjust_keyframes(const BundleOptions& options, const std::vector<KeyframeId>& free_keyframes,
                              int max_fixed, int max_landmarks, Map* map);

/// The options with ten times the loss width, for parts of a map that have just been connected: they are as
/// far apart as they have drifted, and a loss meant for noise would hardly pull them together. Adjust again
/// with the original options afterwards.
BundleOptions with_wide_loss(BundleOptions options);

/// Bundle adjustment of the whole map. The oldest keyframe stays fixed, and one coordinate of the farthest
/// fixes the scale.
BundleReport adjust_map(const BundleOptions& options, Map* map);

}  // namespace mono_pose_tracker
