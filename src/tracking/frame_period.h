#pragma once

#include <array>
#include <cstddef>
#include <mutex>

namespace mono_pose_tracker {

struct FramePeriodOptions {
  double pause_s = 2;          // a longer gap is a pause, not a slow camera
  std::size_t least_gaps = 8;  // fewer may be a single burst
};

/// Estimates the period of a live camera from all images, including dropped ones. May be used from any
/// thread. It has no clock; times are passed in.
class FramePeriod {
 public:
  explicit FramePeriod(const FramePeriodOptions& options = {}) : options_(options) {}

  /// stamp_s: the image's own stamp [s]; arrival_s: its arrival [s, monotonic clock].
  void note(double stamp_s, double arrival_s);

  /// Milliseconds; 0 while not yet known. The lower quartile of the stamp intervals, which is the camera's
  /// period even if a busy machine drops images. Larger where images arrive more slowly than their stamps (a
  /// recording played at half its rate). Pauses do not count.
  double milliseconds() const;

  /// Whether an image has arrived after this time.
  bool has_come_after(double arrival_s) const;

 private:
  static constexpr std::size_t kKept = 32;

  bool is_gap(double seconds) const { return seconds > 0 && seconds < options_.pause_s; }

  const FramePeriodOptions options_;
  mutable std::mutex mutex_;
  std::array<double, kKept> stamp_gaps_s_{}, arrival_gaps_s_{};
  std::size_t noted_ = 0;
  bool has_last_ = false;
  double last_stamp_s_ = 0, last_arrival_s_ = 0;
};

}  // namespace mono_pose_tracker
