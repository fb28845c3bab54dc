#pragma once

#include <Eigen/Core>
#include <vector>

namespace mono_pose_tracker {

/// How far what is seen in these directions in two images (one pair a match) turns before the camera: the
/// movement within it that no rotation of the camera explains, by its size in the image (medians). About a
/// third of the angle (rad) for a ball, up to .6 of it for what is long and flat.
double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2);

}  // namespace mono_pose_tracker
