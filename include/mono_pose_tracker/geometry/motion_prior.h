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

/// How a camera moves: its acceleration is taken for white noise of so much power an axis, squared map units
/// a second cubed (Bar-Shalom et al. 2001, 6.2). Of hand-held cameras, cars and turntables whose truth is
/// known, one change of velocity in a hundred is 3 to 13 sigmas of an axis long, and none longer than 14. 0:
/// nothing is known.
class MotionPrior {
 public:
  MotionPrior() = default;
  /// As the median of the changes of velocity says, from each three centers in a row; fewer than eight tell
  /// nothing.
  explicit MotionPrior(const std::vector<TimedCenter>& in_time);

  explicit operator bool() const { return density_ > 0; }
  /// Of a change of velocity an axis, map units a second, from the mean of the seconds before to that of
  /// those after.
  double sigma_of_change(double seconds_before, double seconds_after) const {
    return std::sqrt(density_ * (seconds_before + seconds_after) / 3);
  }
  double sigma_of(const VelocityChange& change) const {
    return sigma_of_change(change.seconds_before, change.seconds_after);
  }
  /// No camera is known to change its velocity by as much. least: so far at the least the center is off
  /// the line between the two others; what hardly moves moves by noise.
  bool is_beyond(const VelocityChange& change, double least) const;

 private:
  double density_ = 0;
};

/// Of a change of velocity, in sigmas: 99 % of those that are normal are smaller. The loss is 0 up to there:
/// what is usual tells nothing that images don't, and what turns in a circle must not be drawn to its chords.
/// Then it is square, and from twice that on the pull stays as it is: it moves nothing where images say where
/// the camera was, and leads back from far away.
constexpr double kMotionLossWidth = 3.37;

/// Of a square of sigmas.
inline double motion_cost(double squared) {
  constexpr double w = kMotionLossWidth;
  if (squared <= w * w) return 0;
  const double beyond = std::sqrt(squared) - w;
  return beyond <= w ? beyond * beyond : 2 * w * beyond - w * w;
}
/// Its derivative.
inline double motion_slope(double squared) {
  constexpr double w = kMotionLossWidth;
  if (squared <= w * w) return 0;
  const double size = std::sqrt(squared);
  return std::min(size - w, w) / size;
}
/// The derivative of that, where it grows; beyond, 0 keeps what a step takes for the curvature above 0.
inline double motion_bend(double squared) {
  constexpr double w = kMotionLossWidth;
  return squared > w * w && squared < 4 * w * w ? 0.5 * w / (squared * std::sqrt(squared)) : 0;
}

}  // namespace mono_pose_tracker
