#pragma once

#include <Eigen/Core>
#include <array>

namespace mono_pose_tracker {

/// Essential matrices E with x2[i]^T E x1[i] = 0 for five pairs of bearings (any non-zero length).
/// Nister, "An efficient solution to the five-point relative pose problem" (PAMI 2004).
/// Writes up to ten, of Frobenius norm 1 and with E E^T E - 1/2 tr(E E^T) E = 0; returns how many.
/// Degenerate or non-finite input gives 0.
int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials);

}  // namespace mono_pose_tracker
