#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// Projection of three axes with a common origin.
struct ObjectAxes {
  Eigen::Vector2d origin_px;
  std::array<Eigen::Vector2d, 3> tips_px;  // of x, y, z
};

/// camera_from_axes: pose of the axes; length: of each. Nothing when one of the four points is behind the
/// camera.
std::optional<ObjectAxes> project_axes(const CameraModel& camera, const Rigid3& camera_from_axes,
                                       double length);

}  // namespace mono_pose_tracker
