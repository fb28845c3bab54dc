#pragma once

#include <Eigen/Geometry>

namespace mono_pose_tracker {

/// exp([w]x): the turn about w by |w| rad. The identity for a w so short that its direction is lost.
inline Eigen::Quaterniond exp_so3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 1e-300 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                        : Eigen::Quaterniond::Identity();
}

/// The same as a matrix, without the way over a quaternion.
inline Eigen::Matrix3d exp_so3_matrix(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 1e-300 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                        : Eigen::Matrix3d::Identity().eval();
}

}  // namespace mono_pose_tracker
