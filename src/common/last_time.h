#pragma once

#include <cstdint>
#include <optional>

namespace mono_pose_tracker {

/// Limits a rate by time stamps: returns true at most once per period. A stamp that goes back starts a new
/// period.
class LastTime {
 public:
  /// True when a period has passed since the last true, or when the stamp went back.
  bool is_due(std::int64_t now_ns, std::int64_t period_ns) {
    if (last_ns_ && now_ns - *last_ns_ < period_ns && now_ns >= *last_ns_) return false;
    last_ns_ = now_ns;
    return true;
  }

 private:
  std::optional<std::int64_t> last_ns_;
};

}  // namespace mono_pose_tracker
