#pragma once

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// b_from_a with its covariance as ROS defines it: x y z, then rotations about the fixed axes of b.
struct PoseEstimate {
  Rigid3 b_from_a;
  Matrix6d covariance = Matrix6d::Zero();
};

/// c_from_a, with c_from_b exact.
PoseEstimate operator*(const Rigid3& c_from_b, const PoseEstimate& b_from_a);
/// b_from_z, with a_from_z exact.
PoseEstimate operator*(const PoseEstimate& b_from_a, const Rigid3& a_from_z);
PoseEstimate inverse(const PoseEstimate& b_from_a);

}  // namespace mono_pose_tracker
