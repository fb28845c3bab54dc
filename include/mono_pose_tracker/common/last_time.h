#pragma once

#include <cstdint>
#include <optional>

namespace mono_pose_tracker {

/// When something was done last that is done at most once in a while, by stamps; where those go back, anew.
class LastTime {
 public:
  /// Whether it is time again, which then is the last time.
  bool is_due(std::int64_t now_ns, std::int64_t period_ns) {
    if (last_ns_ && now_ns - *last_ns_ < period_ns && now_ns >= *last_ns_) return false;
    last_ns_ = now_ns;
    return true;
  }

 private:
  std::optional<std::int64_t> last_ns_;
};

}  // namespace mono_pose_tracker
