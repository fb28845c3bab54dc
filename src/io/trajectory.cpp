#include "mono_pose_tracker/io/trajectory.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/text.h"
#include "io/atomic_file.h"
#include "io/stamp.h"
#include "io/text_file.h"

namespace mono_pose_tracker {
namespace {

// Poses of a day at 30 Hz.
constexpr std::size_t kMaxBytes = std::size_t{1} << 28;

// Significant ones, not decimals: a map may be measured in micrometres or in kilometres.
constexpr int kDigits = 12;

constexpr const char* kLayout = "timestamp tx ty tz qx qy qz qw";

/// Problem of the pose that a line has, or empty.
std::string set_pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation,
                     StampedPose* pose) {
  // Files are written with few decimals, not with wrong lengths: far from 1 is another column order or no
  // rotation.
  if (std::abs(rotation.norm() - 1) > 0.01) return "has a quaternion that is not of unit length";
  pose->map_from_camera = Rigid3(rotation.normalized(), translation);
  return {};
}

std::string parse_tum(const std::string& stamp, const std::vector<double>& v, StampedPose* pose) {
  if (!parse_stamp_of_any_unit(stamp, false, &pose->stamp_ns))
    return "'" + stamp + "' is not a time stamp in seconds or whole nanoseconds";
  return set_pose({v[6], v[3], v[4], v[5]}, {v[0], v[1], v[2]}, pose);
}

/// EuRoC's data.csv: timestamp [ns], position, quaternion with w first, and more that is not asked for.
std::string parse_euroc(const std::string& stamp, const std::vector<double>& v, StampedPose* pose) {
  if (!parse_stamp_of_any_unit(stamp, true, &pose->stamp_ns))
    return "'" + stamp + "' is not a time stamp in nanoseconds";
  return set_pose({v[3], v[4], v[5], v[6]}, {v[0], v[1], v[2]}, pose);
}

/// KITTI's poses: the upper three rows of a matrix; the stamp is set afterwards.
std::string parse_kitti(const std::vector<double>& v, StampedPose* pose) {
  Eigen::Matrix3d rotation;
  rotation << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
  if ((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > 0.01 ||
      rotation.determinant() < 0)
    return "has a matrix that is not a rotation";
  return set_pose(Eigen::Quaterniond(rotation), {v[3], v[7], v[11]}, pose);
}

enum class Layout { kTum, kEuroc, kKitti };

/// Problem of the line, or empty.
std::string parse_line(std::string line, StampedPose* pose, Layout* layout) {
  const bool has_commas = line.find(',') != std::string::npos;
  std::replace(line.begin(), line.end(), ',', ' ');
  std::istringstream words(line);
  std::vector<std::string> texts;
  std::vector<double> v;  // after the first, as far as they are numbers
  for (std::string word; words >> word;) {
    double value = 0;
    std::istringstream number(word);
    number.imbue(std::locale::classic());
    if (!texts.empty() && v.size() + 1 == texts.size() && number >> value && number.peek() == EOF)
      v.push_back(value);
    texts.push_back(word);
  }
  *layout = has_commas                             ? Layout::kEuroc
            : texts.size() == 12 && v.size() == 11 ? Layout::kKitti
                                                   : Layout::kTum;
  if (*layout == Layout::kKitti) {
    double first = 0;
    if (!parse_decimal(texts[0], &first)) return "begins with '" + texts[0] + "'";
    v.insert(v.begin(), first);
    return parse_kitti(v, pose);
  }
  if (v.size() < 7) return "does not have 8 numbers";
  if (*layout == Layout::kEuroc) return parse_euroc(texts[0], v, pose);
  if (texts.size() > 8) return "has more than 8 values: '" + texts[8] + "'";
  return parse_tum(texts[0], v, pose);
}

/// Stamps for KITTI's poses: from a times.txt in the same folder with the same number of lines, or the index
/// in seconds.
void set_stamps(const std::string& path, std::vector<StampedPose>* poses) {
  std::vector<std::int64_t> stamps;
  const std::filesystem::path times = std::filesystem::path(path).parent_path() / "times.txt";
  std::error_code ignored;
  if (std::filesystem::is_regular_file(times, ignored)) {
    std::istringstream words(read_text_file(times.string(), "time stamps", kMaxBytes));
    std::int64_t stamp_ns = 0;
    for (std::string word; words >> word && parse_stamp(word, &stamp_ns);) stamps.push_back(stamp_ns);
  }
  for (std::size_t i = 0; i < poses->size(); ++i) {
    (*poses)[i].stamp_ns =
        stamps.size() == poses->size() ? stamps[i] : static_cast<std::int64_t>(i) * 1'000'000'000;
  }
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
  bool begins = true, is_kitti = false;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos) continue;
    if (line[start] == '#') {
      if (line.find(kNewMap, start) != std::string::npos) begins = true;
      continue;
    }
    StampedPose pose;
    Layout layout = Layout::kTum;
    const std::string problem = parse_line(line.substr(start), &pose, &layout);
    is_kitti |= layout == Layout::kKitti;
    if (!problem.empty()) {
      throw std::runtime_error(path + ": line " + std::to_string(number) + " " + problem + ": expected `" +
                               kLayout + "`");
    }
    if (std::exchange(begins, false)) maps.emplace_back();
    maps.back().push_back(pose);
  }
  if (is_kitti && maps.size() == 1) set_stamps(path, &maps.front());
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
    throw std::runtime_error(path_ + ": writing failed (" + system_error_text() + ")");
  }
}

}  // namespace mono_pose_tracker
