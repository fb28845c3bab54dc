#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mono_pose_tracker {

/// A rigid motion. A variable `b_from_a` maps a point given in frame a into frame b:
/// x_in_b = rotation * x_in_a + translation.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  Rigid3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : rotation(q), translation(t) {}
  Rigid3(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}

  Eigen::Matrix3d rotation_matrix() const { return rotation.toRotationMatrix(); }

  Rigid3 inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {q, -(q * translation)};
  }

  /// c_from_a = c_from_b * b_from_a
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const { return rotation * x_in_a + translation; }
};

/// [v]x: cross_matrix(v) * x = v x x.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Angle in radians of the rotation that takes a to b.
inline double rotation_angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b);
}

}  // namespace mono_pose_tracker
