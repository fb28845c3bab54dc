#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

struct StampedPose {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

/// Reads TUM lines `timestamp tx ty tz qx qy qz qw` (map_from_camera; # comments and blank lines allowed;
/// seconds or whole nanoseconds), lines of EuRoC's data.csv (`timestamp [ns],x,y,z,qw,qx,qy,qz,...`) or
/// KITTI's (12 numbers, the rows of a 3x4 matrix; stamps from the times.txt beside it, or the index in
/// seconds), and sorts them by stamp. Quaternions are normalised. Throws std::runtime_error, one line naming
/// the file, the line and what was expected.
std::vector<StampedPose> read_tum(const std::string& path);

/// As read_tum, but map by map, as ~trajectory_file and trajectory_live.txt tell them apart: another begins
/// after a comment `# a new map begins ...`. Poses of different maps have nothing in common. None is empty.
std::vector<std::vector<StampedPose>> read_tum_maps(const std::string& path);

/// The comment between the poses of two maps, without its line end; which: "map 2", "epoch 2", ...
std::string new_map_line(const std::string& which);

/// The TUM line of a pose, without its line end: 12 significant digits, whatever the unit of length.
std::string tum_line(const StampedPose& pose);

/// Writes TUM lines, sorted by stamp. Throws std::runtime_error naming the path when it
/// cannot.
void write_tum(const std::string& path, std::vector<StampedPose> poses);

/// Poses by map (FrameReport::map_id); poses of different maps are unrelated.
using PosesByMap = std::map<std::uint32_t, std::vector<StampedPose>>;

/// As write_tum, map by map, so that read_tum_maps tells them apart; sorted by stamp within each.
void write_tum_maps(const std::string& path, PosesByMap maps);

/// Writes TUM lines one by one. Each is handed to the system before append returns, so that no line is lost
/// when the process is killed.
class TrajectoryWriter {
 public:
  /// Replaces the file. Throws std::runtime_error naming the path when it cannot.
  explicit TrajectoryWriter(const std::string& path);
  /// After poses of another map the line that read_tum_maps asks for goes before it.
  void append(const StampedPose& pose, std::uint32_t map_id = 0);

 private:
  std::string path_;
  std::ofstream stream_;
  std::optional<std::uint32_t> map_id_;  // of the last pose
};

}  // namespace mono_pose_tracker
