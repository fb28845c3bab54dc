#pragma once

#include <Eigen/Core>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// The adjoint J of SE(3): maps a small motion x' = exp(w) x + v (order v, w) of frame a to the same motion
/// expressed in frame b, which is rigidly attached to a. Covariances transform as C_b = J C_a J^T.
inline Eigen::Matrix<double, 6, 6> adjoint(const Rigid3& b_from_a) {
  const Eigen::Matrix3d R = b_from_a.rotation_matrix();
  Eigen::Matrix<double, 6, 6> J;
  J << R, cross_matrix(b_from_a.translation) * R, Eigen::Matrix3d::Zero(), R;
  return J;
}

}  // namespace mono_pose_tracker
