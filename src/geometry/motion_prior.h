#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace mono_pose_tracker {

/// Where a camera was, and when.
struct TimedCenter {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d center;
};

/// What the velocity changes by at the second of three centers in a row, and the seconds before and after it.
struct VelocityChange {
  VelocityChange(const TimedCenter& before, const TimedCenter& at, const TimedCenter& after);

  double seconds_before = 0, seconds_after = 0;
  Eigen::Vector3d per_second;  // not finite unless is_timed
  bool is_timed() const { return seconds_before > 0 && seconds_after > 0; }
};

/// How a camera moves: its acceleration is taken for white noise, of one density for each axis, in squared
/// map units per second cubed (Bar-Shalom et al. 2001, 6.2); 0: nothing is known. Of hand-held cameras, cars
/// and turntables whose truth is known, one change of velocity in a hundred is 3 to 13 sigmas of an axis
/// long, and none longer than 14.
class MotionPrior {
 public:
  MotionPrior() = default;
  /// From the median of the changes of velocity, one for each three centers in a row; fewer than eight tell
  /// nothing.
  explicit MotionPrior(const std::vector<TimedCenter>& in_time);

  explicit operator bool() const { return density_ > 0; }
  /// Sigma of each axis of a change of velocity, in map units per second, from the mean over the seconds
  /// before to the mean over the seconds after.
  double sigma_of_change(double seconds_before, double seconds_after) const {
    return std::sqrt(density_ * (seconds_before + seconds_after) / 3);
  }
  double sigma_of(const VelocityChange& change) const {
    return sigma_of_change(change.seconds_before, change.seconds_after);
  }
  /// Whether the velocity changes by more than that of any known camera, and the center is farther than
  /// `least` off the line between the other two: what hardly moves moves by noise.
  bool is_beyond(const VelocityChange& change, double least) const;

 private:
  double density_ = 0;
};

/// Of a change of velocity, in sigmas: 99 % of normally distributed ones are smaller. Up to this width the
/// loss is 0: usual motion tells nothing that images don't, and a camera on a circle must not be drawn to the
/// chords. Then it is quadratic, and linear from twice the width on: weak enough to move nothing where images
/// say where the camera was, and yet leading back from far away.
constexpr double kMotionLossWidth = 3.37;

/// Of a square of sigmas.
inline double motion_cost(double squared) {
  constexpr double w = kMotionLossWidth;
  const double beyond = std::sqrt(squared) - w;
  if (beyond <= 0) return 0;
  return beyond <= w ? beyond * beyond : 2 * w * beyond - w * w;
}
/// Its derivative.
inline double motion_loss_derivative(double squared) {
  constexpr double w = kMotionLossWidth;
  const double size = std::sqrt(squared);
  return size > w ? std::min(size - w, w) / size : 0;
}
/// The derivative of that, where it grows; beyond, 0 keeps what a step takes for the curvature above 0.
inline double motion_loss_second_derivative(double squared) {
  constexpr double w = kMotionLossWidth;
  const double size = std::sqrt(squared);
  return size > w && size < 2 * w ? 0.5 * w / (squared * size) : 0;
}

}  // namespace mono_pose_tracker
