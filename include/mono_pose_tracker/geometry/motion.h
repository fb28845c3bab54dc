#pragma once

#include <Eigen/Core>

namespace mono_pose_tracker {

/// A rigid motion by its matrix, as the solvers find it and the estimators use it: b_from_a maps x_in_a to
/// rotation * x_in_a + translation. Rigid3, with its quaternion, is what is kept. Not initialised: the
/// solvers fill arrays of these millions of times.
struct Motion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

}  // namespace mono_pose_tracker
