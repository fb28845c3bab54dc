#pragma once

#include <cmath>
#include <cstdint>

namespace mono_pose_tracker {

/// The stamps of a video's frames: frame / fps, until the container's times differ from that by more than
/// half a frame (variable frame rate of a phone); the container's times from then on.
class FrameStamps {
 public:
  explicit FrameStamps(double frames_per_second)
      : fps_(frames_per_second), interval_ns_(static_cast<std::int64_t>(std::llround(1e9 / fps_))) {}

  /// Stamp of the next frame. container_ms: time since the first frame; not positive if the container has
  /// none. Stamps increase strictly.
  std::int64_t next(double container_ms);

  /// Number of frames whose container time did not increase; they continue with the interval of the frames
  /// before.
  int out_of_order() const { return out_of_order_; }

 private:
  const double fps_;
  std::int64_t index_ = 0, last_ns_ = -1, interval_ns_;
  bool is_variable_ = false;
  int out_of_order_ = 0;
};

}  // namespace mono_pose_tracker
