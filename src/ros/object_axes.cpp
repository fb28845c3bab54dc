#include "ros/object_axes.h"

namespace mono_pose_tracker {

std::optional<ObjectAxes> project_axes(const CameraModel& camera, const Rigid3& camera_from_axes,
                                       double length) {
  ObjectAxes axes;
  if (!camera.project(camera_from_axes.translation, &axes.origin_px)) return std::nullopt;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d tip = camera_from_axes * Eigen::Vector3d(length * Eigen::Vector3d::Unit(i));
    if (!camera.project(tip, &axes.tips_px[static_cast<std::size_t>(i)])) return std::nullopt;
  }
  return axes;
}

}  // namespace mono_pose_tracker
