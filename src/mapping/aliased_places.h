#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// When two places show the same structure but are not one (perceptual aliasing), or cannot be distinguished.
struct AliasedPlaceOptions {
  double aliased_share = 0.75;  // of the best place's inliers. An aliased place lacks the details of the
                                // right one; a place with more inliers cannot be distinguished from it
  double max_drift = 0.3;       // share of the path length between two keyframes. Drift without a loss of
                                // tracking was a tenth at most in our measurements; the limit is three times
                                // that. An aliased place further on is off by the whole path length
  /// rad. A heading error that grows evenly along the path moves its end by half of that angle. Aliased
  /// places that the camera passed in the opposite direction, such as the two walls of a corridor, differ by
  /// far more.
  double max_rotation_drift = 2 * max_drift;
  double elsewhere_px = 10;  // at 640 px (image_scale), median: several times the disagreement of poses at
                             // one and the same place
};

/// Length of the path from one keyframe to the other, over the keyframes between them in time, in the map's
/// unit. The order of time is not the order of ids in a merged map.
template <typename Keyframes, typename Keyframe>
double path_length_between(const Keyframes& keyframes, const Keyframe& one, const Keyframe& other) {
  const auto [first, last] = std::minmax(one.frame_index, other.frame_index);
  std::map<std::int64_t, Eigen::Vector3d> centers;
  for (const auto& [id, keyframe] : keyframes) {
    if (keyframe.frame_index < first || keyframe.frame_index > last) continue;
    centers[keyframe.frame_index] = keyframe.camera_from_map.inverse().translation;
  }
  double length = 0;
  for (auto at = centers.begin(); at != centers.end() && std::next(at) != centers.end(); ++at)
    length += (std::next(at)->second - at->second).norm();
  return length;
}

/// Median distance in the image between expected and observed points, px. Each pair holds the expected and
/// the observed point, in the camera's frame. The distance of points behind the camera is a million, and so
/// is the result where no expected point is in view.
double disagreement_px(const CameraModel& camera,
                       const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& x_in_camera);

}  // namespace mono_pose_tracker
