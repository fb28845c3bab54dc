#include "mapping/unit_source.h"

#include <algorithm>
#include <cmath>

#include "geometry/triangulation.h"

namespace mono_pose_tracker {

namespace {

// The triangulated corners of a marker; none when the cameras do not determine them.
std::vector<Eigen::Vector3d> marker_corners(const std::vector<Rigid3>& cameras_from_map,
                                            const std::vector<std::vector<Eigen::Vector3d>>& markers) {
  if (markers.size() < 2) return {};
  std::vector<Eigen::Vector3d> corners(4);
  for (int c = 0; c < 4; ++c) {
    std::vector<Eigen::Vector3d> bearings;
    bearings.reserve(markers.size());
    for (const auto& marker : markers) bearings.push_back(marker[c]);
    if (!triangulate_multi_view(cameras_from_map, bearings, &corners[c])) return {};
  }
  return corners;
}

double side(const std::vector<Eigen::Vector3d>& corners, int c) {
  return (corners[(c + 1) % 4] - corners[c]).norm();
}

double mean_side(const std::vector<Eigen::Vector3d>& corners) {
  double sum = 0;
  for (int c = 0; c < 4; ++c) sum += side(corners, c);
  return sum / 4;
}

bool is_square(const std::vector<Eigen::Vector3d>& corners, double max_side_difference) {
  const double mean = mean_side(corners);
  for (int c = 0; c < 4; ++c) {
    if (std::abs(side(corners, c) - mean) > max_side_difference * mean) return false;
  }
  return true;
}

// The widest parallax between the first camera and any other.
double widest_parallax(const std::vector<Rigid3>& cameras_from_map, const Eigen::Vector3d& x_in_map) {
  double widest = 0;
  const Eigen::Vector3d first = cameras_from_map.front().inverse().translation;
  for (const Rigid3& camera : cameras_from_map) {
    widest = std::max(widest, parallax_angle(x_in_map, first, camera.inverse().translation));
  }
  return widest;
}

std::optional<double> metres_by_baseline(double known_baseline, const UnitSource& unit, const Map& map) {
  if (!unit.baseline) return std::nullopt;
  Rigid3 first, last;
  if (!map.camera_from_map(unit.baseline->first, &first)) return std::nullopt;
  if (!map.camera_from_map(unit.baseline->second, &last)) return std::nullopt;
  return known_baseline / (last.inverse().translation - first.inverse().translation).norm();
}

std::optional<double> metres_by_marker(double marker_size, const MapperLimits& limits, const UnitSource& unit,
                                       const Map& map) {
  std::vector<Rigid3> cameras_from_map;
  std::vector<std::vector<Eigen::Vector3d>> markers;
  for (const auto& [id, corners] : unit.markers) {
    const Keyframe* keyframe = map.keyframe(id);
    if (!keyframe) continue;  // culled meanwhile
    cameras_from_map.push_back(keyframe->camera_from_map);
    markers.push_back(corners);
  }
  const std::vector<Eigen::Vector3d> corners = marker_corners(cameras_from_map, markers);
  if (corners.empty() || !is_square(corners, limits.max_side_difference) ||
      widest_parallax(cameras_from_map, corners[0]) < limits.marker_parallax) {
    return std::nullopt;
  }
  return marker_size / mean_side(corners);
}

}  // namespace

std::optional<double> UnitSource::metres(ScaleSource source, const ScaleOptions& scale,
                                         const MapperLimits& limits, const Map& map) const {
  if (source == ScaleSource::kKnownBaseline) return metres_by_baseline(scale.known_baseline, *this, map);
  if (source == ScaleSource::kMarker) return metres_by_marker(scale.marker_size, limits, *this, map);
  return std::nullopt;
}

ScaleSource UnitSource::begin(const InitialMap& initial, const std::vector<KeyframeId>& ids,
                              const ScaleOptions& scale) {
  if (scale.known_baseline > 0) {
    baseline = {ids.front(), ids.back()};
    return ScaleSource::kKnownBaseline;
  }
  if (scale.marker_size <= 0) return ScaleSource::kMapUnits;
  for (std::size_t v = 0; v < ids.size(); ++v) {
    if (!initial.views[v].frame.marker.empty()) markers[ids[v]] = initial.views[v].frame.marker;
  }
  return ScaleSource::kMarker;
}

void UnitSource::forget(const std::set<KeyframeId>& wrong, const Map& map) {
  if (baseline && !map.keyframe(baseline->second) && wrong.count(baseline->second) > 0) baseline.reset();
  for (const KeyframeId id : wrong) {
    if (!map.keyframe(id)) markers.erase(id);
  }
}

}  // namespace mono_pose_tracker
