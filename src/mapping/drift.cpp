#include "mono_pose_tracker/mapping/drift.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>

namespace mono_pose_tracker {

double way_between(const TrackingMap& map, const KeyframeView& one, const KeyframeView& other) {
  const auto [first, last] = std::minmax(one.frame_index, other.frame_index);
  std::map<std::int64_t, Eigen::Vector3d> centers;
  for (const auto& [id, keyframe] : map.keyframes) {
    if (keyframe.frame_index < first || keyframe.frame_index > last) continue;
    centers[keyframe.frame_index] = keyframe.camera_from_map.inverse().translation;
  }
  double length = 0;
  for (auto at = centers.begin(); at != centers.end() && std::next(at) != centers.end(); ++at) {
    length += (std::next(at)->second - at->second).norm();
  }
  return length;
}

}  // namespace mono_pose_tracker
