// The part of the Mapper that determines the unit of a map.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/triangulation.h"
#include "mapping/mapper.h"

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

}  // namespace

void Mapper::rescale(double factor) {
  map_.rescale(factor);
  scale_covariances([&](KeyframeId) { return factor; });
}

// Sets the scale from the first views after their adjustment.
void Mapper::set_scale(const InitialMap& initial, const std::vector<KeyframeId>& ids) {
  const ScaleOptions& scale = options_.scale;
  if (scale.known_baseline > 0) {
    unit_.baseline = {ids.front(), ids.back()};
    rescale(*metres_by_baseline());
    map_.set_scale_source(ScaleSource::kKnownBaseline);
  } else if (scale.marker_size > 0) {
    for (std::size_t v = 0; v < ids.size(); ++v) {
      if (!initial.views[v].frame.marker.empty()) unit_.markers[ids[v]] = initial.views[v].frame.marker;
    }
    const std::optional<double> metres = metres_by_marker();
    if (!metres) return;
    rescale(*metres);
    map_.set_scale_source(ScaleSource::kMarker);
  }
}

// Metres in a map unit, from the known baseline. A culled view has its stored pose.
std::optional<double> Mapper::metres_by_baseline() const {
  if (!unit_.baseline) return std::nullopt;
  Rigid3 first, last;
  if (!map_.camera_from_map(unit_.baseline->first, &first)) return std::nullopt;
  if (!map_.camera_from_map(unit_.baseline->second, &last)) return std::nullopt;
  return options_.scale.known_baseline / (last.inverse().translation - first.inverse().translation).norm();
}

// Evaluates the source of the unit again after a global adjustment: at the beginning it was accurate to some
// per cent, and bundle adjustment does not preserve it. least_change: relative. Returns whether the unit has
// changed; the correction is still to be published.
bool Mapper::renew_scale(double least_change) {
  std::optional<double> metres;
  if (map_.scale_source() == ScaleSource::kKnownBaseline) metres = metres_by_baseline();
  if (map_.scale_source() == ScaleSource::kMarker) metres = metres_by_marker();
  if (!metres || std::abs(*metres - 1) <= least_change) return false;
  move_map(Sim3(*metres, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()));
  return true;
}

// Metres in a map unit, from the keyframes that observe the marker; nothing while their parallax is too
// small.
std::optional<double> Mapper::metres_by_marker() const {
  std::vector<Rigid3> cameras_from_map;
  std::vector<std::vector<Eigen::Vector3d>> markers;
  for (const auto& [id, corners] : unit_.markers) {
    const Keyframe* keyframe = map_.keyframe(id);
    if (!keyframe) continue;  // culled meanwhile
    cameras_from_map.push_back(keyframe->camera_from_map);
    markers.push_back(corners);
  }
  const std::vector<Eigen::Vector3d> corners = marker_corners(cameras_from_map, markers);
  if (corners.empty() || !is_square(corners, limits_.max_side_difference) ||
      widest_parallax(cameras_from_map, corners[0]) < limits_.marker_parallax) {
    return std::nullopt;
  }
  return options_.scale.marker_size / mean_side(corners);
}

// Sets the scale by a marker that could not be used at the beginning.
void Mapper::scale_by_marker(KeyframeId newest, const std::vector<Eigen::Vector3d>& marker) {
  if (options_.scale.marker_size <= 0 || map_.scale_source() != ScaleSource::kMapUnits || marker.empty()) {
    return;
  }
  unit_.markers[newest] = marker;
  const std::optional<double> metres = metres_by_marker();
  if (!metres) return;
  transform(Sim3(*metres, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), ScaleSource::kMarker);
}

}  // namespace mono_pose_tracker
