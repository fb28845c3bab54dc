#pragma once

#include <cstdint>
#include <optional>

namespace mono_pose_tracker {

/// Limits a rate by stamps: true at most once a period. A stamp that goes back starts over.
class LastTime {
 public:
  /// True when a period has passed since it last was, or a stamp has gone back.
  bool is_due(std::int64_t now_ns, std::int64_t period_ns) {
    if (last_ns_ && now_ns - *last_ns_ < period_ns && now_ns >= *last_ns_) return false;
    last_ns_ = now_ns;
    return true;
  }

 private:
  std::optional<std::int64_t> last_ns_;
};

}  // namespace mono_pose_tracker
