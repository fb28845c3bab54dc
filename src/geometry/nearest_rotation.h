#pragma once

#include <Eigen/Dense>

namespace mono_pose_tracker {

/// The rotation with the least Frobenius distance to a matrix: of a sum of b a^T, the one that takes the
/// vectors a nearest to the vectors b (Kabsch, 1976).
inline Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace mono_pose_tracker
