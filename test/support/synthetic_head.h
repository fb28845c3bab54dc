#pragma once

#include <cmath>
#include <vector>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {

/// The front of a head of half a unit around the origin, with the face along -z. A view from 6 units is
/// narrow.
inline SyntheticScene synthetic_head(int points, Random& random) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (int i = 0; i < points; ++i) {
    const double azimuth = random.uniform(-1.3, 1.3), height = random.uniform(-0.6, 0.6);
    x_in_map.emplace_back(0.5 * std::sin(azimuth), height, -0.5 * std::cos(azimuth));
  }
  return SyntheticScene(x_in_map, random);
}

/// A view from 6 units, rotated about a slightly tilted axis.
inline Rigid3 before_turned_head(double angle_rad) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.2, 1, 0).normalized();
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis)), Eigen::Vector3d(0, 0, 6)};
}

}  // namespace mono_pose_tracker
