#include "mono_pose_tracker/mapping/in_view.h"

#include <algorithm>
#include <iterator>

namespace mono_pose_tracker {

namespace {

constexpr double kLeastInView = 2.0 / 3;

const Eigen::Vector3d& place(const Landmark& landmark) { return landmark.x_in_map; }
const Eigen::Vector3d& place(const Eigen::Vector3d& x_in_map) { return x_in_map; }

template <typename Landmarks>
bool has_in_view(const Landmarks& landmarks, const Rigid3& camera_from_map, const CameraModel& camera) {
  const auto in_view = std::count_if(landmarks.begin(), landmarks.end(), [&](const auto& entry) {
    Eigen::Vector2d pixel;
    return camera.project(camera_from_map * place(entry.second), &pixel) && camera.in_image(pixel);
  });
  return static_cast<double>(in_view) >= kLeastInView * static_cast<double>(landmarks.size());
}

}  // namespace

bool stays_in_view(const Map& map) {
  return std::all_of(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
    const Keyframe& k = entry.second;
    return !map.landmarks().empty() && has_in_view(map.landmarks(), k.camera_from_map, k.image->camera);
  });
}

bool newest_has_in_view(const TrackingMap& map, const CameraModel& camera) {
  if (map.keyframes.empty()) return true;
  const auto newest = std::prev(map.keyframes.end());
  return has_in_view(map.landmarks, newest->second.camera_from_map, camera);
}

}  // namespace mono_pose_tracker
