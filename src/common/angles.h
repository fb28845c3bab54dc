#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace mono_pose_tracker {

constexpr double kPi = 3.14159265358979323846;

/// A degree in radians: 30 * kDegree is 30 degrees, angle / kDegree an angle in degrees.
constexpr double kDegree = kPi / 180;

/// Of two vectors of any length, in radians, [0, pi]; exact also where they are nearly parallel.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace mono_pose_tracker
