#pragma once

namespace mono_pose_tracker {

constexpr double kPi = 3.14159265358979323846;

/// A degree in radians: 30 * kDegree is an angle, angle / kDegree what is told of it.
constexpr double kDegree = kPi / 180;

}  // namespace mono_pose_tracker
