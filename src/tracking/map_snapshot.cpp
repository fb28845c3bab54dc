#include "map_snapshot.h"

#include <unordered_set>

namespace mono_pose_tracker {

std::shared_ptr<const MapSnapshot> snapshot_of(const TrackingMapPtr& map) {
  auto snapshot = std::make_shared<MapSnapshot>();
  if (!map) return snapshot;
  snapshot->epoch = map->epoch;
  snapshot->revision = map->revision;
  std::unordered_set<LandmarkId> known;
  for (const auto& [id, keyframe] : map->keyframes) {
    snapshot->keyframes.push_back({keyframe.stamp_ns, keyframe.camera_from_map.inverse()});
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const auto landmark = map->landmarks.find(keyframe.landmark_of_feature[f]);
      if (landmark == map->landmarks.end() || !known.insert(landmark->first).second) continue;
      const cv::Vec3b& rgb = keyframe.image->color_rgb[f];
      snapshot->points.push_back({landmark->second.cast<float>(), rgb[0], rgb[1], rgb[2]});
    }
  }
  return snapshot;
}

}  // namespace mono_pose_tracker
