#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace mono_pose_tracker {

/// Position of a camera centre at a time.
struct TimedCenter {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d center;
};

/// Change of velocity at the second of three consecutive centres, and the time before and after it [s].
struct VelocityChange {
  VelocityChange(const TimedCenter& before, const TimedCenter& at, const TimedCenter& after);

  double seconds_before = 0, seconds_after = 0;
  Eigen::Vector3d per_second;  // not finite unless is_timed
  bool is_timed() const { return seconds_before > 0 && seconds_after > 0; }
};

/// Motion model of a camera: its acceleration is white noise of one density per axis, in squared map units
/// per second cubed (Bar-Shalom et al. 2001, 6.2); 0: unknown. On recordings with ground truth (hand-held
/// cameras, cars, turntables) the 99th percentile of the velocity changes is 3 to 13 sigmas of an axis, and
/// the maximum is 14.
class MotionPrior {
 public:
  MotionPrior() = default;
  /// Estimated from the median velocity change over all triples of consecutive centres; unknown with fewer
  /// than eight.
  explicit MotionPrior(const std::vector<TimedCenter>& in_time);

  explicit operator bool() const { return density_ > 0; }
  /// Standard deviation of each axis of a velocity change [map units/s], between the mean velocities over the
  /// two intervals [s].
  double sigma_of_change(double seconds_before, double seconds_after) const {
    return std::sqrt(density_ * (seconds_before + seconds_after) / 3);
  }
  double sigma_of(const VelocityChange& change) const {
    return sigma_of_change(change.seconds_before, change.seconds_after);
  }
  /// Whether the velocity change exceeds that of any known camera. The centre must also be farther than
  /// `least` from the line through its neighbours, because noise dominates the velocity of a camera at rest.
  bool is_beyond(const VelocityChange& change, double least) const;

 private:
  double density_ = 0;
};

/// Width of the motion loss in sigmas: the 99 % quantile of a normally distributed velocity change. The loss
/// is 0 up to this width, so that ordinary motion has no influence (a camera on a circle is not drawn to the
/// chords). It is quadratic up to twice the width and linear beyond. It is too weak to move cameras that the
/// images determine, and it still pulls distant outliers back.
constexpr double kMotionLossWidth = 3.37;

/// Motion loss rho of a squared residual in sigmas.
inline double motion_cost(double squared) {
  constexpr double w = kMotionLossWidth;
  const double beyond = std::sqrt(squared) - w;
  if (beyond <= 0) return 0;
  return beyond <= w ? beyond * beyond : 2 * w * beyond - w * w;
}
/// First derivative of the motion loss.
inline double motion_loss_derivative(double squared) {
  constexpr double w = kMotionLossWidth;
  const double size = std::sqrt(squared);
  return size > w ? std::min(size - w, w) / size : 0;
}
/// Second derivative of the motion loss where it is positive, else 0: the curvature used by a step stays
/// above 0.
inline double motion_loss_second_derivative(double squared) {
  constexpr double w = kMotionLossWidth;
  const double size = std::sqrt(squared);
  return size > w && size < 2 * w ? 0.5 * w / (squared * size) : 0;
}

}  // namespace mono_pose_tracker
