#include "map_snapshot.h"

#include <map>
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

std::vector<PosedFrame> trajectory_in(const TrackingMap& map, const FramePoses& poses) {
  std::map<std::int64_t, KeyframeId> keyframe_of_frame;
  for (const auto& [id, link] : map.removed_keyframes) keyframe_of_frame[link.frame_index] = id;
  for (const auto& [id, keyframe] : map.keyframes) keyframe_of_frame[keyframe.frame_index] = id;
  std::vector<PosedFrame> frames;
  for (const auto& [index, pose] : poses.all()) {
    // Where a removed keyframe stood was found earlier than a final pose.
    const auto own = pose.is_final ? keyframe_of_frame.end() : keyframe_of_frame.find(index);
    Rigid3 camera_from_map;
    if ((own != keyframe_of_frame.end() && map.camera_from_map(own->second, &camera_from_map)) ||
        poses.camera_from_map(map, index, &camera_from_map)) {
      frames.push_back({index, pose.stamp_ns, camera_from_map.inverse()});
    }
  }
  return frames;
}

}  // namespace mono_pose_tracker
