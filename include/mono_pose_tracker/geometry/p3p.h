#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/geometry/motion.h"

namespace mono_pose_tracker {

/// Poses with bearings_in_camera[i] parallel to camera_from_map * points_in_map[i], the points in front of
/// the camera. Finsterwalder's method as in Haralick, Lee, Ottenberg and Noelle, "Review and analysis of
/// solutions of the three point perspective pose estimation problem" (IJCV 1994). Bearings are unit. Writes
/// up to four, no two the same; returns how many. Collinear or coincident points, parallel bearings and
/// non-finite input give 0.
int p3p(const std::array<Eigen::Vector3d, 3>& bearings_in_camera,
        const std::array<Eigen::Vector3d, 3>& points_in_map, std::array<Motion, 4>* cameras_from_map);

}  // namespace mono_pose_tracker
