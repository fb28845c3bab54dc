#include "mono_pose_tracker/mapping/scale_collapse.h"

#include <algorithm>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

std::vector<double> distances(const Map& map, const Keyframe& keyframe) {
  std::vector<double> result;
  for (const LandmarkId l : landmarks_of(keyframe)) {
    result.push_back((keyframe.camera_from_map * map.landmark(l)->x_in_map).norm());
  }
  return result;
}

}  // namespace

ScaleCollapse worst_scale_collapse(const Map& map) {
  ScaleCollapse worst;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const std::vector<double> away = distances(map, keyframe);
    if (away.empty()) continue;
    const double nearest = ScaleCollapse::kNearest * median(std::vector<double>(away));
    const auto near = std::count_if(away.begin(), away.end(), [&](double d) { return d < nearest; });
    if (near <= worst.near) continue;
    worst = {keyframe.frame_index, static_cast<int>(away.size()), static_cast<int>(near)};
  }
  return worst;
}

}  // namespace mono_pose_tracker
