#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/geometry/motion.h"

namespace mono_pose_tracker {

/// Essential matrices E with x2[i]^T E x1[i] = 0 for five pairs of bearings (any non-zero length).
/// Nister, "An efficient solution to the five-point relative pose problem" (PAMI 2004), in a parametrisation
/// that stays well conditioned where the camera nearly only turns. Writes up to ten, of Frobenius norm 1 and
/// with E E^T E - 1/2 tr(E E^T) E = 0; returns how many. Degenerate or non-finite input gives 0.
int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials);

/// Motions second_from_first, the translation of unit length, that have the rays of all five pairs of unit
/// bearings meet in front of both cameras, or do so within an angular error of `tolerance` (radians). Writes
/// up to 40 (four for each essential matrix; as a rule at most one of them has the points in front); returns
/// how many.
int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               double tolerance, std::array<Motion, 40>* motions);

}  // namespace mono_pose_tracker
