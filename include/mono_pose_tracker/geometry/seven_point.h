#pragma once

#include <Eigen/Core>
#include <array>

namespace mono_pose_tracker {

/// Matrices F of rank 2 with x2[i]^T F x1[i] = 0 for seven pairs (Hartley and Zisserman, section 11.1.2).
/// Writes up to three, of Frobenius norm 1; returns how many. Degenerate or non-finite input gives 0.
int seven_point(const std::array<Eigen::Vector3d, 7>& x1, const std::array<Eigen::Vector3d, 7>& x2,
                std::array<Eigen::Matrix3d, 3>* fundamentals);

}  // namespace mono_pose_tracker
