#include "mono_pose_tracker/mapping/in_view.h"

#include <algorithm>
#include <cstddef>

namespace mono_pose_tracker {

namespace {

constexpr double kLeastInView = 2.0 / 3;

bool is_in_view(const CameraModel& camera, const Eigen::Vector3d& x_in_camera) {
  Eigen::Vector2d pixel;
  return camera.project(x_in_camera, &pixel) && camera.in_image(pixel);
}

bool is_enough(std::ptrdiff_t in_view, std::ptrdiff_t all) {
  return static_cast<double>(in_view) >= kLeastInView * static_cast<double>(all);
}

bool has_in_view(const Map& map, const Keyframe& keyframe) {
  const auto in_view = std::count_if(map.landmarks().begin(), map.landmarks().end(), [&](const auto& entry) {
    return is_in_view(keyframe.image->camera, keyframe.camera_from_map * entry.second.x_in_map);
  });
  return in_view > 0 && is_enough(in_view, static_cast<std::ptrdiff_t>(map.landmarks().size()));
}

}  // namespace

bool stays_in_view(const Map& map) {
  return std::all_of(map.keyframes().begin(), map.keyframes().end(),
                     [&](const auto& entry) { return has_in_view(map, entry.second); });
}

bool has_left_behind(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map) {
  constexpr std::size_t kMostAsked = 1000;  // landmarks: the share is known to a hundredth or two
  constexpr double kLeastBehind = 0.05;     // of one that is wrong here and there
  const std::size_t step = 1 + map.landmarks.size() / kMostAsked;
  std::size_t at = 0;
  std::ptrdiff_t asked = 0, in_view = 0, behind = 0;
  for (const auto& entry : map.landmarks) {
    if (at++ % step != 0) continue;
    const Eigen::Vector3d x_in_camera = camera_from_map * entry.second;
    ++asked;
    in_view += is_in_view(camera, x_in_camera);
    behind += x_in_camera.z() <= 0;
  }
  return !is_enough(in_view, asked) &&
         static_cast<double>(behind) >= kLeastBehind * static_cast<double>(asked);
}

}  // namespace mono_pose_tracker
