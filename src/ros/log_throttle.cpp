#include "ros/log_throttle.h"

namespace mono_pose_tracker {

bool LogThrottle::due(const std::string& subject, Clock::time_point now) {
  if (subject.empty()) return true;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto [said, is_new] = said_.emplace(subject, now);
  if (!is_new && now - said->second < period_) return false;
  said->second = now;
  return true;
}

}  // namespace mono_pose_tracker
