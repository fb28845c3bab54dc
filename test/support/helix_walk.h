#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

inline Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * M_PI / 180, axis.normalized()));
}

/// A camera that walks along a helix and looks about.
inline std::vector<StampedPose> helix_walk(int count, std::int64_t period_ns) {
  std::vector<StampedPose> poses(count);
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i;
    poses[i] = {period_ns * i,
                Rigid3(turn(20 * t, {1, t, 0.3}), {3 * std::cos(t), 3 * std::sin(t), 0.5 * t})};
  }
  return poses;
}

}  // namespace mono_pose_tracker
