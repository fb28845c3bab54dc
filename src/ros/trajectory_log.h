#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// A trajectory file (TUM lines: timestamp tx ty tz qx qy qz qw, map_from_camera) that is complete at any
/// moment: each pose is handed to the system at once, so that nothing is lost when the process is killed. The
/// file holds whole lines only. Lines that cannot be written (disk full) wait and are written later; beyond
/// kMostWaiting the oldest are lost, and a comment in the file counts them. A file that is moved or removed
/// (log rotation) is created again. May be called from any thread; never waits for the reader of a pipe.
class TrajectoryLog {
 public:
  static constexpr std::size_t kMostWaiting = 100000;  // poses: an hour at 30 Hz, 12 MB

  /// Starts the file anew. Throws std::runtime_error naming the file.
  explicit TrajectoryLog(const std::string& path);
  ~TrajectoryLog();
  TrajectoryLog(const TrajectoryLog&) = delete;
  TrajectoryLog& operator=(const TrajectoryLog&) = delete;

  /// Appends the pose of a registered frame; a comment marks the start of another map.
  void append(const FrameReport& report);

  /// Tries again to write what waits.
  void retry();

  /// Number of times the file was created again after removal.
  std::size_t renewals() const;

  /// Error with the file name and the number of waiting lines; empty when all is written.
  std::string problem() const;

 private:
  bool is_in_place() const;
  bool renew();
  void write_waiting();
  bool write_first();

  const std::string path_;
  mutable std::mutex mutex_;  // guards what follows
  int file_ = -1;
  std::deque<std::string> waiting_;  // lines, the first perhaps without what could not be taken back
  std::size_t lost_ = 0;             // told by the line with the number note_; -1: there is none
  int note_ = -1;
  std::size_t renewals_ = 0;
  std::string reason_;  // why the first of them waits
  std::uint32_t epoch_ = 0, map_id_ = 0;
  bool empty_ = true;
};

/// Writes a whole trajectory: a reader sees the old file or the whole new one. Throws std::runtime_error
/// naming the file, or, the old file being left as it is, when there are no poses.
void write_tum_trajectory(const std::string& path, const std::vector<KeyframePose>& poses);

}  // namespace mono_pose_tracker
