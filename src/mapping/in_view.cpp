#include "mapping/in_view.h"

#include <algorithm>
#include <vector>

namespace mono_pose_tracker {

namespace {

constexpr InViewOptions kInView{};

bool is_in_view(const CameraModel& camera, const Eigen::Vector3d& x_in_camera) {
  Eigen::Vector2d pixel;
  return camera.project(x_in_camera, &pixel) && camera.in_image(pixel);
}

std::vector<Eigen::Vector3d> positions_of(const Map& map) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (const auto& entry : map.landmarks()) x_in_map.push_back(entry.second.x_in_map);
  return x_in_map;
}

double share_in_view(const std::vector<Eigen::Vector3d>& x_in_map, const Keyframe& keyframe) {
  const auto in_view = std::count_if(x_in_map.begin(), x_in_map.end(), [&](const Eigen::Vector3d& x) {
    return is_in_view(keyframe.image->camera, keyframe.camera_from_map * x);
  });
  return x_in_map.empty() ? 0 : static_cast<double>(in_view) / static_cast<double>(x_in_map.size());
}

}  // namespace

bool stays_in_view(const Map& map) {
  const std::vector<Eigen::Vector3d> x_in_map = positions_of(map);
  return std::all_of(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
    return share_in_view(x_in_map, entry.second) >= kInView.least_share;
  });
}

bool has_left_behind(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map) {
  const std::size_t step = 1 + map.landmarks.size() / kInView.max_sampled;
  std::size_t at = 0;
  std::ptrdiff_t asked = 0, in_view = 0, behind = 0;
  for (const auto& entry : map.landmarks) {
    if (at++ % step != 0) continue;
    const Eigen::Vector3d x_in_camera = camera_from_map * entry.second;
    ++asked;
    const bool is_visible = is_in_view(camera, x_in_camera);  // a fisheye lens may show z <= 0
    in_view += is_visible;
    behind += !is_visible && x_in_camera.z() <= 0;
  }
  return static_cast<double>(in_view) < kInView.least_share * static_cast<double>(asked) &&
         static_cast<double>(behind) >= kInView.least_behind * static_cast<double>(asked);
}

}  // namespace mono_pose_tracker
