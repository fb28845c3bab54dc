#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

namespace mono_pose_tracker {

/// Lets what goes on be said once in a while only. Each subject counts for itself, and each LogThrottle:
/// unlike rosconsole's *_THROTTLE macros, which count by the line of the source for a whole process, no
/// message is hidden by one about something else or of another nodelet. By the steady clock: ROS time may
/// stand still or jump. May be called from any thread.
class LogThrottle {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LogThrottle(Clock::duration period) : period_(period) {}

  /// Whether a message is due: about this subject none has been for a period. subject: what the message is
  /// about, without its numbers; empty: an event, which is always said.
  bool due(const std::string& subject, Clock::time_point now = Clock::now());

 private:
  const Clock::duration period_;
  std::mutex mutex_;
  std::map<std::string, Clock::time_point> said_;
};

}  // namespace mono_pose_tracker
