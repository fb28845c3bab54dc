#include "frame_stamps.h"

#include <cmath>

namespace mono_pose_tracker {

std::int64_t FrameStamps::next(double container_ms) {
  constexpr double kMost = 1e12;  // ms: thirty years
  const auto frame_ns = static_cast<std::int64_t>(std::llround(static_cast<double>(index_++) * 1e9 / fps_));
  const bool has_time = container_ms > 0 && container_ms < kMost;
  if (has_time && !is_variable_) {
    is_variable_ = std::abs(container_ms * 1e-3 - static_cast<double>(frame_ns) * 1e-9) > 0.5 / fps_;
  }
  std::int64_t stamp_ns = frame_ns;
  if (is_variable_) stamp_ns = has_time ? static_cast<std::int64_t>(std::llround(container_ms * 1e6)) : -1;
  if (stamp_ns <= last_ns_) {
    ++out_of_order_;
    stamp_ns = last_ns_ + interval_ns_;
  } else if (is_variable_ && last_ns_ >= 0) {
    interval_ns_ = stamp_ns - last_ns_;
  }
  last_ns_ = stamp_ns;
  return stamp_ns;
}

}  // namespace mono_pose_tracker
