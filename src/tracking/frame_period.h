#pragma once

#include <array>
#include <cstddef>
#include <mutex>

namespace mono_pose_tracker {

/// The time between two images of a live camera, from all that come, those that are dropped among them. May
/// be used from any thread; knows no clock: times are told.
class FramePeriod {
 public:
  /// stamp_s: the image's own stamp [s]; arrival_s: when it came [s, of a clock that only grows].
  void note(double stamp_s, double arrival_s);

  /// Milliseconds; 0 while not yet known. The lower quartile of the intervals of stamps, which says what the
  /// camera does though a busy machine loses images before they are told of; more where they come more slowly
  /// than their stamps say (a recording played at half its rate). Pauses do not count.
  double milliseconds() const;

  /// Whether one has come after the one that came then.
  bool has_come_after(double arrival_s) const;

 private:
  static constexpr std::size_t kKept = 32;

  mutable std::mutex mutex_;
  std::array<double, kKept> stamp_gaps_s_{}, arrival_gaps_s_{};
  std::size_t noted_ = 0;
  bool has_last_ = false;
  double last_stamp_s_ = 0, last_arrival_s_ = 0;
};

}  // namespace mono_pose_tracker
