#include "mapping/aliased_places.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>

#include "common/median.h"

namespace mono_pose_tracker {

double path_length_between(const TrackingMap& map, const KeyframeView& one, const KeyframeView& other) {
  const auto [first, last] = std::minmax(one.frame_index, other.frame_index);
  std::map<std::int64_t, Eigen::Vector3d> centers;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (keyframe.frame_index < first || keyframe.frame_index > last) continue;
    centers[keyframe.frame_index] = keyframe.camera_from_map.inverse().translation;
  }
  double length = 0;
  for (auto at = centers.begin(); at != centers.end() && std::next(at) != centers.end(); ++at) {
    length += (std::next(at)->second - at->second).norm();
  }
  return length;
}

double disagreement_px(const CameraModel& camera,
                       const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& x_in_camera) {
  constexpr double kNotSeen = 1e6;
  std::vector<double> errors;
  for (const auto& [x_expected, x_found] : x_in_camera) {
    Eigen::Vector2d expected, pixel;
    if (!camera.project(x_expected, &expected)) continue;
    errors.push_back(camera.project(x_found, &pixel) ? (pixel - expected).norm() : kNotSeen);
  }
  return errors.empty() ? kNotSeen : median(std::move(errors));
}

}  // namespace mono_pose_tracker
