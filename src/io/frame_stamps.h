#pragma once

#include <cstdint>

namespace mono_pose_tracker {

/// The stamps of a video's frames: frame / fps, until the container's own times differ from that by more than
/// half a frame, as where a phone varies its frame rate; from then on those times.
class FrameStamps {
 public:
  explicit FrameStamps(double frames_per_second) : fps_(frames_per_second) {}

  /// Of the next frame. container_ms: since the first one; not positive where the container has none. Each is
  /// later than the one before.
  std::int64_t next(double container_ms);

  /// Frames whose time was not later than that of the frame before, so that one of the frame rate stands in
  /// its place.
  int out_of_order() const { return out_of_order_; }

 private:
  const double fps_;
  std::int64_t index_ = 0, last_ns_ = -1;
  bool is_variable_ = false;
  int out_of_order_ = 0;
};

}  // namespace mono_pose_tracker
