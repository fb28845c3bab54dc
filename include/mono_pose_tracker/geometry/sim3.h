#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// A similarity `b_from_a`: x_in_b = scale * (rotation * x_in_a) + translation. They form a group.
struct Sim3 {
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Sim3() = default;
  Sim3(double s, const Eigen::Quaterniond& r, const Eigen::Vector3d& t)
      : scale(s), rotation(r), translation(t) {}
  static Sim3 scaling(double factor) {
    return {factor, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  }
  explicit Sim3(const Rigid3& rigid) : rotation(rigid.rotation), translation(rigid.translation) {}

  Sim3 inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {1 / scale, r, -(r * translation) / scale};
  }

  /// c_from_a = c_from_b * b_from_a
  Sim3 operator*(const Sim3& other) const {
    return {scale * other.scale, (rotation * other.rotation).normalized(), *this * other.translation};
  }

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const {
    return scale * (rotation * x_in_a) + translation;
  }
};

/// b_from_a with the least sum of squared distances (Umeyama, PAMI 1991; Eigen's implementation). False when
/// there are fewer than three pairs or all points coincide. align_se3 seeks no scale: it is 1.
bool align_sim3(const std::vector<Eigen::Vector3d>& points_in_a,
                const std::vector<Eigen::Vector3d>& points_in_b, Sim3* b_from_a);
bool align_se3(const std::vector<Eigen::Vector3d>& points_in_a,
               const std::vector<Eigen::Vector3d>& points_in_b, Sim3* b_from_a);

/// The same of three pairs, the columns; nothing is allocated.
bool align_sim3(const Eigen::Matrix3d& points_in_a, const Eigen::Matrix3d& points_in_b, Sim3* b_from_a);

}  // namespace mono_pose_tracker
