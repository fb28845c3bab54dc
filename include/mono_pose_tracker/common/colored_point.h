#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace mono_pose_tracker {

struct ColoredPoint {
  Eigen::Vector3f x_in_map;
  std::uint8_t r = 0, g = 0, b = 0;
};

}  // namespace mono_pose_tracker
