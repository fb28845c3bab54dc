// The part of the Mapper that gives a map its unit.

#include <utility>
#include <vector>

#include "mono_pose_tracker/geometry/triangulation.h"
#include "mono_pose_tracker/mapping/mapper.h"

namespace mono_pose_tracker {

namespace {

// Mean side of a marker in map units, its corners seen from these cameras; 0 when they can't tell.
double marker_side(const std::vector<Rigid3>& cameras_from_map,
                   const std::vector<std::vector<Eigen::Vector3d>>& markers) {
  if (markers.size() < 2) return 0;
  std::vector<Eigen::Vector3d> corners(4);
  for (int c = 0; c < 4; ++c) {
    std::vector<Eigen::Vector3d> bearings;
    for (const auto& marker : markers) bearings.push_back(marker[c]);
    if (!triangulate_multi_view(cameras_from_map, bearings, &corners[c])) return 0;
  }
  double sum = 0;
  for (int c = 0; c < 4; ++c) sum += (corners[(c + 1) % 4] - corners[c]).norm();
  return sum / 4;
}

}  // namespace

// By what is known of the views, after their poses have been adjusted.
void Mapper::set_scale(const InitialMap& initial, const std::vector<KeyframeId>& ids) {
  const ScaleOptions& scale = options_.scale;
  if (scale.known_baseline > 0) {
    const double baseline =
        (map_.keyframe(ids.front())->center_in_map() - map_.keyframe(ids.back())->center_in_map()).norm();
    map_.rescale(scale.known_baseline / baseline);
    map_.set_scale_source(ScaleSource::kKnownBaseline);
  } else if (scale.marker_size > 0) {
    std::vector<Rigid3> cameras_from_map;
    std::vector<std::vector<Eigen::Vector3d>> markers;
    for (std::size_t v = 0; v < ids.size(); ++v) {
      if (initial.views[v].frame.marker.empty()) continue;
      cameras_from_map.push_back(map_.keyframe(ids[v])->camera_from_map);
      markers.push_back(initial.views[v].frame.marker);
    }
    const double side = marker_side(cameras_from_map, markers);
    if (side <= 0) return;
    map_.rescale(scale.marker_size / side);
    map_.set_scale_source(ScaleSource::kMarker);
  }
}

}  // namespace mono_pose_tracker
