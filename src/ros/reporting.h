#pragma once

#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <string>

namespace mono_pose_tracker {

/// Runs the action of a callback and passes any exception to tell(text). Otherwise roscpp would let it leave
/// its thread, which ends the process with all nodelets of the manager. tell may throw as well (out of
/// memory); that exception is ignored.
template <typename Action, typename Tell>
void guarded(const Action& action, const Tell& tell) noexcept {
  const auto try_to_tell = [&tell](const char* what) {
    try {
      tell(std::string(what));
    } catch (...) {
    }
  };
  try {
    action();
  } catch (const std::exception& e) {
    try_to_tell(e.what());
  } catch (...) {
    try_to_tell("unknown exception");
  }
}

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

inline bool LogThrottle::due(const std::string& subject, Clock::time_point now) {
  if (subject.empty()) return true;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto [said, is_new] = said_.emplace(subject, now);
  if (!is_new && now - said->second < period_) return false;
  said->second = now;
  return true;
}

}  // namespace mono_pose_tracker
