#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

namespace mono_pose_tracker {

/// A 3x3 matrix row by row, and a tenth number, zero, that makes five pairs of it.
using Row10 = Eigen::Matrix<double, 10, 1>;

/// An orthonormal basis of what N conditions of unit length (their tenth entry zero) leave free: the last
/// columns of the Q of a Householder QR decomposition, mirrored along `mirror`. Overwrites the conditions.
/// False when they are not finite or depend on each other.
template <int N>
bool null_space(Row10 (&conditions)[N], const Eigen::Matrix<double, 9 - N, 1>& mirror,
                Row10 (&basis)[9 - N]) {
  // Reflections I - v v^T; the entries before k stay as they are, v has zeros there.
  for (int k = 0; k < N; ++k) {
    Row10& v = conditions[k];
    for (int i = 0; i < k; ++i) v[i] = 0;
    const double length2 = v.squaredNorm();
    // What the reflections before it leave of a condition is the sine of its angle to them.
    if (!(length2 > 1e-24 && length2 < 2)) return false;
    const double length = std::sqrt(length2);
    v[k] += std::copysign(length, v[k]);
    v *= 1 / std::sqrt(length * std::abs(v[k]));
    for (int j = k + 1; j < N; ++j) conditions[j] -= v.dot(conditions[j]) * v;
  }
  for (int j = 0; j < 9 - N; ++j) {
    basis[j].setZero();
    basis[j].template segment<9 - N>(N) = mirror * (-2 * mirror[j] / mirror.squaredNorm());
    basis[j][N + j] += 1;
    for (int k = N - 1; k >= 0; --k) basis[j] -= conditions[k].dot(basis[j]) * conditions[k];
  }
  return true;
}

/// A basis of the matrices M with x2[i]^T M x1[i] = 0.
template <int N>
bool epipolar_null_space(const std::array<Eigen::Vector3d, N>& x1, const std::array<Eigen::Vector3d, N>& x2,
                         const Eigen::Matrix<double, 9 - N, 1>& mirror, Row10 (&basis)[9 - N]) {
  Row10 conditions[N];
  for (int i = 0; i < N; ++i) {
    const Eigen::Vector3d &a = x1[i], &b = x2[i];
    conditions[i] << b.x() * a, b.y() * a, b.z() * a, 0;
    conditions[i] *= 1 / std::sqrt(a.squaredNorm() * b.squaredNorm());
  }
  return null_space<N>(conditions, mirror, basis);
}

inline Eigen::Matrix3d as_matrix3(const Row10& v) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

}  // namespace mono_pose_tracker
