#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/random.h"

namespace mono_pose_tracker {

/// Points of a skyline at 3000 to 5000, the first of them, and of things 2 to 5 units away before it.
inline std::vector<Eigen::Vector3d> skyline_points(int far, int near, Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < far + near; ++i) {
    const double depth = i < far ? random.uniform(3000, 5000) : random.uniform(2, 5);
    x.emplace_back(depth * random.uniform(-0.4, 0.4), depth * random.uniform(-0.3, 0.3), depth);
  }
  return x;
}

}  // namespace mono_pose_tracker
