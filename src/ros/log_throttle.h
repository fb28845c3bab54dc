#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

namespace mono_pose_tracker {

/// Limits the rate of repeated messages, separately for each subject and each LogThrottle. Unlike
/// rosconsole's *_THROTTLE macros, which count by source line for a whole process, no message is hidden by
/// another subject or nodelet. Uses the steady clock, because ROS time may stop or jump. May be called from
/// any thread.
class LogThrottle {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LogThrottle(Clock::duration period) : period_(period) {}

  /// Whether a message is due: none about this subject in the last period. subject: the message without its
  /// numbers; empty: an event, which is always due.
  bool due(const std::string& subject, Clock::time_point now = Clock::now());

 private:
  const Clock::duration period_;
  std::mutex mutex_;
  std::map<std::string, Clock::time_point> said_;
};

}  // namespace mono_pose_tracker
