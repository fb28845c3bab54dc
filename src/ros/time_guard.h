#pragma once

#include <cstdint>
#include <optional>

namespace mono_pose_tracker {

/// Decides by its stamp whether an image may be tracked: stamps must grow. A small step back is a late image,
/// a large one a restart of the recording.
class TimeGuard {
 public:
  enum class Verdict { kAccept, kStale, kJumpedBack };

  /// jump_ns: a step back larger than this is a new start.
  explicit TimeGuard(std::int64_t jump_ns) : jump_ns_(jump_ns) {}

  Verdict check(std::int64_t stamp_ns) {
    if (last_ns_ && stamp_ns <= *last_ns_ && *last_ns_ - stamp_ns <= jump_ns_) return Verdict::kStale;
    const bool jumped = last_ns_ && stamp_ns < *last_ns_;
    last_ns_ = stamp_ns;
    return jumped ? Verdict::kJumpedBack : Verdict::kAccept;
  }

  /// The newest stamp accepted.
  std::optional<std::int64_t> last() const { return last_ns_; }

  /// Forgets the past: the next image is accepted whatever its stamp.
  void restart() { last_ns_.reset(); }

 private:
  std::int64_t jump_ns_;
  std::optional<std::int64_t> last_ns_;
};

}  // namespace mono_pose_tracker
