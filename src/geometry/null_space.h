#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <array>

namespace mono_pose_tracker {

/// An orthonormal basis of the matrices M with x2[i]^T M x1[i] = 0, as columns of row-major 3x3 matrices.
/// False when the N conditions are not finite or depend on each other.
template <int N>
bool epipolar_null_space(const std::array<Eigen::Vector3d, N>& x1, const std::array<Eigen::Vector3d, N>& x2,
                         Eigen::Matrix<double, 9, 9 - N>* basis) {
  Eigen::Matrix<double, 9, N> conditions;
  for (int i = 0; i < N; ++i) {
    conditions.col(i) << x2[i].x() * x1[i], x2[i].y() * x1[i], x2[i].z() * x1[i];
    conditions.col(i).normalize();
  }
  if (!conditions.allFinite()) return false;
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 9, N>> qr(conditions);
  // The conditions have unit length: what is left of the last one is how far it is from depending on the
  // others.
  if (std::abs(qr.matrixR()(N - 1, N - 1)) < 1e-12) return false;
  const Eigen::Matrix<double, 9, 9> q = qr.householderQ();
  *basis = q.template rightCols<9 - N>();
  return true;
}

template <typename Vector>
Eigen::Matrix3d as_matrix3(const Vector& v) {
  Eigen::Matrix3d m;
  m << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  return m;
}

}  // namespace mono_pose_tracker
