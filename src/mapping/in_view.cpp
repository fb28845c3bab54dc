#include "mono_pose_tracker/mapping/in_view.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

constexpr double kLeastInView = 2.0 / 3;

double share_in_view(const Map& map, const Keyframe& keyframe) {
  const CameraModel& camera = keyframe.image->camera;
  const auto in_view = std::count_if(map.landmarks().begin(), map.landmarks().end(), [&](const auto& entry) {
    Eigen::Vector2d pixel;
    return camera.project(keyframe.camera_from_map * entry.second.x_in_map, &pixel) && camera.in_image(pixel);
  });
  return static_cast<double>(in_view) / static_cast<double>(std::max<std::size_t>(1, map.landmarks().size()));
}

}  // namespace

bool stays_in_view(const Map& map) {
  return std::all_of(map.keyframes().begin(), map.keyframes().end(),
                     [&](const auto& entry) { return share_in_view(map, entry.second) >= kLeastInView; });
}

}  // namespace mono_pose_tracker
