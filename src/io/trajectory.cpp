#include "mono_pose_tracker/io/trajectory.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "mono_pose_tracker/common/system_error.h"
#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/stamp.h"
#include "mono_pose_tracker/io/text_file.h"

namespace mono_pose_tracker {
namespace {

// Poses of a day at 30 Hz.
constexpr std::size_t kMaxBytes = std::size_t{1} << 28;

// Significant ones, not decimals: a map may be measured in micrometres or in kilometres.
constexpr int kDigits = 12;

constexpr const char* kLayout = "timestamp tx ty tz qx qy qz qw";

/// Problem of the line, or empty.
std::string parse_line(const std::string& line, StampedPose* pose) {
  std::istringstream words(line);
  words.imbue(std::locale::classic());
  std::string stamp;
  words >> stamp;
  if (!parse_stamp(stamp, &pose->stamp_ns)) return "'" + stamp + "' is no time stamp in seconds";
  std::array<double, 7> v;
  for (double& value : v) {
    if (!(words >> value)) return "has not 8 numbers";
  }
  std::string rest;
  if (words >> rest) return "goes on with '" + rest + "'";
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  // Files are written with few decimals, not with wrong lengths: far from 1 is another column order or no
  // rotation.
  if (std::abs(rotation.norm() - 1) > 0.01) return "has a quaternion that is not of unit length";
  pose->map_from_camera = Rigid3(rotation.normalized(), {v[0], v[1], v[2]});
  return {};
}

void sort_by_stamp(std::vector<StampedPose>* poses) {
  std::stable_sort(poses->begin(), poses->end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns < b.stamp_ns; });
}

constexpr char kNewMap[] = "a new map begins";

std::string line_before_map(std::uint32_t map_id) {
  return new_map_line("map " + std::to_string(map_id)) + '\n';
}

}  // namespace

std::string new_map_line(const std::string& which) {
  return std::string("# ") + kNewMap + " (" + which + "): another origin and scale";
}

std::string tum_line(const StampedPose& pose) {
  const Eigen::Vector3d& t = pose.map_from_camera.translation;
  Eigen::Quaterniond q = pose.map_from_camera.rotation;
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // the same rotation, written one way
  std::ostringstream line;
  line.imbue(std::locale::classic());
  line << format_stamp(pose.stamp_ns) << std::setprecision(kDigits);
  for (double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    line << ' ' << value + 0.0;  // not -0
  }
  return line.str();
}

std::vector<std::vector<StampedPose>> read_tum_maps(const std::string& path) {
  std::istringstream lines(read_text_file(path, std::string("lines `") + kLayout + "`", kMaxBytes));
  std::vector<std::vector<StampedPose>> maps;
  bool begins = true;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos) continue;
    if (line[start] == '#') {
      if (line.find(kNewMap, start) != std::string::npos) begins = true;
      continue;
    }
    StampedPose pose;
    const std::string problem = parse_line(line, &pose);
    if (!problem.empty()) {
      throw std::runtime_error(path + ": line " + std::to_string(number) + " " + problem + ": expected `" +
                               kLayout + "`");
    }
    if (std::exchange(begins, false)) maps.emplace_back();
    maps.back().push_back(pose);
  }
  for (std::vector<StampedPose>& poses : maps) sort_by_stamp(&poses);
  return maps;
}

std::vector<StampedPose> read_tum(const std::string& path) {
  std::vector<StampedPose> all;
  for (const std::vector<StampedPose>& poses : read_tum_maps(path)) {
    all.insert(all.end(), poses.begin(), poses.end());
  }
  sort_by_stamp(&all);
  return all;
}

void write_tum(const std::string& path, std::vector<StampedPose> poses) {
  sort_by_stamp(&poses);
  write_file_atomically(path, [&](std::ostream& out) {
    for (const StampedPose& pose : poses) out << tum_line(pose) << '\n';
  });
}

void write_tum_maps(const std::string& path, PosesByMap maps) {
  write_file_atomically(path, [&](std::ostream& out) {
    bool is_first = true;
    for (auto& [map_id, poses] : maps) {
      if (poses.empty()) continue;
      if (!std::exchange(is_first, false)) out << line_before_map(map_id);
      sort_by_stamp(&poses);
      for (const StampedPose& pose : poses) out << tum_line(pose) << '\n';
    }
  });
}

TrajectoryWriter::TrajectoryWriter(const std::string& path) : path_(path) {
  errno = 0;
  stream_.open(path, std::ios::binary | std::ios::trunc);
  if (!stream_) {
    throw std::runtime_error(path + ": cannot be written (" + system_error_text() + ")");
  }
  stream_.imbue(std::locale::classic());
}

void TrajectoryWriter::append(const StampedPose& pose, std::uint32_t map_id) {
  errno = 0;
  if (map_id_ && *map_id_ != map_id) stream_ << line_before_map(map_id);
  map_id_ = map_id;
  stream_ << tum_line(pose) << '\n';
  stream_.flush();
  if (!stream_) {
    throw std::runtime_error(path_ + ": cannot be written further (" + system_error_text() + ")");
  }
}

}  // namespace mono_pose_tracker
