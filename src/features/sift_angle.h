#pragma once

#include <cmath>

namespace mono_pose_tracker {

constexpr float kTwoPi = 6.2831853f;

/// Direction of (x, y) in rad, in [0, 2 pi]; error below 1e-4. No branches: a loop of it becomes vector code.
/// The polynomial is the minimax fit of atan on [0, 1].
inline float direction(float y, float x) {
  const float ax = std::fabs(x);
  const float ay = std::fabs(y);
  const float high = ax > ay ? ax : ay;
  const float low = ax > ay ? ay : ax;
  const float t = low / (high + 1e-30f);
  const float t2 = t * t;
  float angle = t * (0.99997726f +
                     t2 * (-0.33262347f +
                           t2 * (0.19354346f + t2 * (-0.11643287f + t2 * (0.05265332f - t2 * 0.01172120f)))));
  angle = ay > ax ? 0.25f * kTwoPi - angle : angle;
  angle = x < 0 ? 0.5f * kTwoPi - angle : angle;
  return y < 0 ? kTwoPi - angle : angle;
}

}  // namespace mono_pose_tracker
