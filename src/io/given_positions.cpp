#include "io/given_positions.h"

#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/rotation.h"
#include "common/text.h"
#include "io/text_file.h"

namespace mono_pose_tracker {
namespace {

constexpr std::size_t kMaxPositionBytes = std::size_t{1} << 28;
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

bool are_numbers(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
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
  std::istringstream lines(read_text_file(path, kPositionLayout, kMaxPositionBytes));
  std::string line;
  bool found = false;
  while (!found && std::getline(lines, line)) found = holds_something(line);
  if (!found) throw std::runtime_error(path + ": holds no position: expected " + kPositionLayout);
  const std::vector<std::string> words = words_of(line);
  GivenPositions positions;
  if (words.size() == 8 && are_numbers(words)) {
    positions.poses = read_tum(path);
    return positions;
  }
  lines.clear();
  lines.seekg(0);
  return read_geodetic(path, lines);
}

}  // namespace mono_pose_tracker
