#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <locale>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/rotation.h"
#include "common/text.h"
#include "common/time_stamp.h"
#include "io/files.h"
#include "io/given_positions.h"
#include "io/stamp.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a sign off the front: true when it is a minus.
bool take_sign(std::string_view* text) {
  if (text->empty() || (text->front() != '-' && text->front() != '+')) return false;
  const bool negative = text->front() == '-';
  text->remove_prefix(1);
  return negative;
}

/// Takes an exponent off the front; false when there is something else.
bool take_exponent(std::string_view* text, int* exponent) {
  *exponent = 0;
  if (text->empty()) return true;
  if (text->front() != 'e' && text->front() != 'E') return false;
  text->remove_prefix(1);
  const bool negative = take_sign(text);
  if (text->empty() || text->size() > 3 || !std::all_of(text->begin(), text->end(), is_digit)) return false;
  for (char c : *text) *exponent = 10 * *exponent + (c - '0');
  if (negative) *exponent = -*exponent;
  return true;
}

/// The value of digits with `decimals` of them after the point, in units of 1e-9. False when it is beyond
/// kMaxStampNs.
bool to_nanoseconds(const std::string& digits, int decimals, std::uint64_t* value) {
  constexpr std::uint64_t kLimit = kMaxStampNs;
  const int kept = static_cast<int>(digits.size()) - decimals + 9;  // digits down to the nanosecond
  *value = 0;
  for (int i = 0; i < kept; ++i) {
    const std::uint64_t digit = i < static_cast<int>(digits.size()) ? digits[i] - '0' : 0;
    if (*value > (kLimit - digit) / 10) return false;
    *value = 10 * *value + digit;
  }
  const bool round_up = kept >= 0 && kept < static_cast<int>(digits.size()) && digits[kept] >= '5';
  if (round_up && *value == kLimit) return false;
  *value += round_up;
  return true;
}

}  // namespace

bool parse_stamp(std::string_view text, std::int64_t* stamp_ns) {
  const bool negative = take_sign(&text);
  std::string digits;
  int decimals = 0;
  bool after_point = false;
  while (!text.empty() && (is_digit(text.front()) || (text.front() == '.' && !after_point))) {
    if (text.front() == '.') {
      after_point = true;
    } else {
      digits += text.front();
      decimals += after_point;
    }
    text.remove_prefix(1);
  }
  int exponent = 0;
  std::uint64_t value = 0;
  if (digits.empty() || !take_exponent(&text, &exponent)) return false;
  if (!to_nanoseconds(digits, decimals - exponent, &value)) return false;
  *stamp_ns = negative ? -static_cast<std::int64_t>(value) : static_cast<std::int64_t>(value);
  return true;
}

bool parse_stamp_of_any_unit(std::string_view text, bool is_ns, std::int64_t* stamp_ns) {
  const bool is_whole = !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
  if (!is_whole || (!is_ns && parse_stamp(text, stamp_ns))) return parse_stamp(text, stamp_ns);
  // Of this century, seconds have 10 digits; the units below 3 more each.
  const std::size_t digits = text.size();
  const bool is_of_a_unit = is_ns || digits > 14 || digits == 13 || digits == 12;
  if (!is_of_a_unit) return false;
  const int decimals = is_ns || digits > 16 ? 9 : digits > 13 ? 6 : 3;
  return parse_stamp(std::string(text) + "e-" + std::to_string(decimals), stamp_ns);
}

std::string format_stamp(std::int64_t stamp_ns) {
  // Through unsigned numbers: the smallest int64 has no positive counterpart.
  const std::uint64_t magnitude =
      stamp_ns < 0 ? ~static_cast<std::uint64_t>(stamp_ns) + 1 : static_cast<std::uint64_t>(stamp_ns);
  const std::string decimals = std::to_string(magnitude % 1000000000u);
  return (stamp_ns < 0 ? "-" : "") + std::to_string(magnitude / 1000000000u) + '.' +
         std::string(9 - decimals.size(), '0') + decimals;
}

namespace {

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
    std::istringstream words(read_text_file(times.string(), "time stamps"));
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
  // Significant digits, not decimals: a map may be measured in micrometres or in kilometres.
  line << format_stamp(pose.stamp_ns) << std::setprecision(12);
  for (double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    line << ' ' << value + 0.0;  // not -0
  }
  return line.str();
}

std::vector<std::vector<StampedPose>> read_tum_maps(const std::string& path) {
  std::istringstream lines(read_text_file(path, std::string("lines `") + kLayout + "`"));
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

namespace {

constexpr const char* kPositionLayout =
    "TUM lines `timestamp tx ty tz qx qy qz qw` or lines `image-name latitude longitude altitude`";

// WGS 84: semi-major axis in m, flattening.
constexpr double kSemiMajorAxis = 6378137.0;
constexpr double kFlattening = 1 / 298.257223563;

/// Earth-centred, Earth-fixed coordinates in m.
Eigen::Vector3d earth_centred(const GeodeticPoint& point) {
  const double latitude = point.latitude_deg * kDegree, longitude = point.longitude_deg * kDegree;
  const double e2 = kFlattening * (2 - kFlattening);
  const double n = kSemiMajorAxis / std::sqrt(1 - e2 * std::sin(latitude) * std::sin(latitude));
  return {(n + point.altitude) * std::cos(latitude) * std::cos(longitude),
          (n + point.altitude) * std::cos(latitude) * std::sin(longitude),
          (n * (1 - e2) + point.altitude) * std::sin(latitude)};
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// Eight numbers, which may be none (nan): read_tum says so then.
bool is_tum_line(const std::vector<std::string>& words) {
  if (words.size() != 8) return false;
  for (const std::string& word : words) {
    if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf") continue;
    std::istringstream stream(word);  // as in TUM files: 1e9, +1
    stream.imbue(std::locale::classic());
    double value = 0;
    if (!(stream >> value) || stream.peek() != std::istringstream::traits_type::eof()) return false;
  }
  return true;
}

/// What the line before its last three words is: a name may hold spaces.
std::string name_in(const std::string& line) {
  std::size_t end = line.size();
  for (int word = 0; word < 3; ++word) {
    end = line.find_last_not_of(" \t\r", end - 1) + 1;
    end = line.find_last_of(" \t", end - 1);
  }
  const std::size_t begin = line.find_first_not_of(" \t");
  return line.substr(begin, line.find_last_not_of(" \t", end) + 1 - begin);
}

/// Problem of the line, or empty.
std::string parse_geodetic(const std::string& line, std::string* name, GeodeticPoint* point) {
  const std::vector<std::string> words = words_of(line);
  if (is_tum_line(words)) return "is a TUM line among lines with names";
  if (words.size() < 4) return "does not have a name and three numbers";
  double* const values[] = {&point->latitude_deg, &point->longitude_deg, &point->altitude};
  for (int i = 0; i < 3; ++i) {
    const std::string& word = words[words.size() - 3 + i];
    if (!parse_decimal(word, values[i])) return "has '" + one_line(word) + "', which is not a number";
  }
  if (std::abs(point->latitude_deg) > 90) return "has a latitude beyond 90 degrees";
  if (std::abs(point->longitude_deg) > 360) return "has a longitude beyond 360 degrees";
  if (std::abs(point->altitude) > 1e6) return "has an altitude beyond 1000 km";
  *name = name_in(line);
  return {};
}

bool holds_something(const std::string& line) {
  const std::size_t start = line.find_first_not_of(" \t\r");
  return start != std::string::npos && line[start] != '#';
}

GivenPositions read_geodetic(const std::string& path, std::istringstream& lines) {
  GivenPositions positions;
  std::set<std::string> names;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (!holds_something(line)) continue;
    NamedPosition position;
    GeodeticPoint point;
    std::string problem = parse_geodetic(line, &position.name, &point);
    if (problem.empty() && !names.insert(position.name).second) {
      problem = "names " + one_line(position.name) + " a second time";
    }
    if (!problem.empty()) {
      throw std::runtime_error(path + ": line " + std::to_string(number) + " " + problem + ": expected " +
                               kPositionLayout);
    }
    if (!positions.origin) positions.origin = point;
    position.x_in_world = east_north_up(*positions.origin, point);
    positions.named.push_back(std::move(position));
  }
  return positions;
}

}  // namespace

Eigen::Vector3d east_north_up(const GeodeticPoint& origin, const GeodeticPoint& point) {
  const double latitude = origin.latitude_deg * kDegree, longitude = origin.longitude_deg * kDegree;
  const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
  const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
  Eigen::Matrix3d rows;
  rows << -sin_lon, cos_lon, 0,                         // east
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  // north
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;    // up
  return rows * (earth_centred(point) - earth_centred(origin));
}

GivenPositions read_given_positions(const std::string& path) {
  std::istringstream lines(read_text_file(path, kPositionLayout));
  std::string line;
  bool found = false;
  while (!found && std::getline(lines, line)) found = holds_something(line);
  if (!found) throw std::runtime_error(path + ": holds no position: expected " + kPositionLayout);
  GivenPositions positions;
  if (is_tum_line(words_of(line))) {
    positions.poses = read_tum(path);
    return positions;
  }
  lines.clear();
  lines.seekg(0);
  return read_geodetic(path, lines);
}

}  // namespace mono_pose_tracker
