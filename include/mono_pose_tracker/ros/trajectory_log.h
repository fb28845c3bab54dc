#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// A trajectory file (TUM lines: timestamp tx ty tz qx qy qz qw, map_from_camera) that is complete at any
/// moment: each pose is handed to the system as it comes, so that nothing is lost when the process is killed.
class TrajectoryLog {
 public:
  /// Starts the file anew. Throws std::runtime_error naming the file.
  explicit TrajectoryLog(const std::string& path);

  /// Appends the pose of a posed frame; a comment says where another map begins.
  void append(const FrameReport& report);

 private:
  std::string path_;
  std::ofstream file_;
  std::uint32_t epoch_ = 0;
  bool empty_ = true;
};

/// Writes a whole trajectory. Throws std::runtime_error naming the file.
void write_tum_trajectory(const std::string& path, const std::vector<KeyframePose>& poses);

}  // namespace mono_pose_tracker
