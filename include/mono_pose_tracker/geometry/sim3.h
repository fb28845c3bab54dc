#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace mono_pose_tracker {

/// x_in_b = scale * (rotation * x_in_a) + translation
struct Sim3 {
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const {
    return scale * (rotation * x_in_a) + translation;
  }
};

/// b_from_a with the least sum of squared distances (Umeyama, PAMI 1991; Eigen's implementation). False when
/// there are fewer than three pairs or all points coincide.
bool align_sim3(const std::vector<Eigen::Vector3d>& points_in_a,
                const std::vector<Eigen::Vector3d>& points_in_b, Sim3* b_from_a);

}  // namespace mono_pose_tracker
