#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Feature `feature` of an image as an observation of point `point` by camera `camera`.
BundleObservation make_observation(int camera, int point, const ImageFeatures& image, int feature);

/// Bundle adjustment of the given keyframes and all landmarks they see; other keyframes that see these stay
/// where they are and hold the gauge (at most max_fixed of them, those that see most). The cameras are
/// adjusted with max_landmarks of each free keyframe, spread over its image, that most keyframes see: they
/// hold the poses best, and converge soonest; the others, and what one keyframe of the problem sees, follow
/// under all that see them. Not usable: the map is as it was. The loss width is options.loss_width times the
/// residuals' own spread (median), so that sharp images are held to tighter errors than blurred ones.
BundleReport adjust_keyframes(const BundleOptions& options, const std::vector<KeyframeId>& free_keyframes,
                              int max_fixed, int max_landmarks, Map* map);

/// The same with ten times the loss width, for parts that were just tied: they are as far apart as they have
/// drifted, and the loss meant for noise would hardly let them pull. To be adjusted once more with the
/// options themselves.
BundleOptions with_wide_loss(BundleOptions options);

/// Bundle adjustment of everything. The oldest keyframe stays, and one coordinate of the farthest holds the
/// scale.
BundleReport adjust_map(const BundleOptions& options, Map* map);

/// The same, where cameras are also held to move as they usually do (geometry/motion_prior.h): one that sees
/// only what is far is led back from where it can hardly have been.
BundleReport adjust_map_as_it_moved(const BundleOptions& options, Map* map);

/// Whether some keyframe is where no camera goes between those before and after it, by this much at the
/// least.
bool moves_beyond_belief(const Map& map, double least);

}  // namespace mono_pose_tracker
