#include "tracking/map_snapshot.h"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_set>
#include <utility>

namespace mono_pose_tracker {

namespace {

// Adds a keyframe and those of its points that are not yet added.
void add_view(const TrackingMap& map, const KeyframeView& keyframe, std::unordered_set<LandmarkId>* known,
              MapSnapshot* snapshot) {
  snapshot->keyframes.push_back({keyframe.stamp_ns, keyframe.camera_from_map.inverse()});
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const auto landmark = map.landmarks.find(keyframe.landmark_of_feature[f]);
    if (landmark == map.landmarks.end() || !known->insert(landmark->first).second) continue;
    const cv::Vec3b& rgb = keyframe.image->color_rgb[f];
    snapshot->points.push_back({landmark->second.cast<float>(), rgb[0], rgb[1], rgb[2]});
  }
}

}  // namespace

std::shared_ptr<const MapSnapshot> snapshot_of(const TrackingMapPtr& map) {
  auto snapshot = std::make_shared<MapSnapshot>();
  if (!map) return snapshot;
  snapshot->epoch = map->epoch;
  snapshot->revision = map->revision;
  std::unordered_set<LandmarkId> known;
  for (const auto& entry : map->keyframes) add_view(*map, entry.second, &known, snapshot.get());
  return snapshot;
}

MapSnapshot newest_view_of(const TrackingMapPtr& map) {
  MapSnapshot snapshot;
  if (!map) return snapshot;
  snapshot.epoch = map->epoch;
  snapshot.revision = map->revision;
  std::unordered_set<LandmarkId> known;
  if (!map->keyframes.empty()) add_view(*map, map->keyframes.rbegin()->second, &known, &snapshot);
  return snapshot;
}

namespace {

using FrameIterator = std::vector<RegisteredFrame>::iterator;

// Interpolates a pose in time between two poses.
Rigid3 between(const RegisteredFrame& before, const RegisteredFrame& after, std::int64_t stamp_ns) {
  const Rigid3 &a = before.map_from_camera, &b = after.map_from_camera;
  const auto since = static_cast<double>(stamp_ns - before.stamp_ns),
             whole = static_cast<double>(after.stamp_ns - before.stamp_ns);
  const double s = whole > 0 ? since / whole : 0;
  return {a.rotation.slerp(s, b.rotation), (1 - s) * a.translation + s * b.translation};
}

// Interpolates frames with invalid poses between the others; before the first and after the last valid one
// they have no pose.
std::vector<RegisteredFrame> put_between(std::vector<RegisteredFrame> frames,
                                         const std::set<std::int64_t>& stale) {
  const auto holds = [&](const RegisteredFrame& frame) { return stale.count(frame.index) == 0; };
  std::vector<RegisteredFrame> result;
  for (FrameIterator frame = frames.begin(); frame != frames.end(); ++frame) {
    if (!holds(*frame)) {
      const FrameIterator after = std::find_if(frame, frames.end(), holds);
      if (result.empty() || after == frames.end()) continue;
      frame->map_from_camera = between(result.back(), *after, frame->stamp_ns);
    }
    result.push_back(*frame);
  }
  return result;
}

}  // namespace

std::vector<RegisteredFrame> trajectory_in(const TrackingMap& map, const FramePoses& poses) {
  std::map<std::int64_t, KeyframeId> keyframe_of_frame;
  for (const auto& [id, link] : map.removed_keyframes) keyframe_of_frame[link.frame_index] = id;
  for (const auto& [id, keyframe] : map.keyframes) keyframe_of_frame[keyframe.frame_index] = id;
  std::vector<RegisteredFrame> frames;
  std::set<std::int64_t> stale;
  for (const auto& [index, pose] : poses.all()) {
    // A final pose is newer than the stored pose of a removed keyframe.
    const auto own = pose.is_final ? keyframe_of_frame.end() : keyframe_of_frame.find(index);
    Rigid3 camera_from_map;
    if ((own == keyframe_of_frame.end() || !map.camera_from_map(own->second, &camera_from_map)) &&
        !poses.camera_from_map(map, index, &camera_from_map)) {
      continue;
    }
    frames.push_back({index, pose.stamp_ns, camera_from_map.inverse()});
    const bool is_keyframe = own != keyframe_of_frame.end() && map.keyframes.count(own->second) > 0;
    if (pose.is_stale && !is_keyframe) stale.insert(index);
  }
  return stale.empty() ? frames : put_between(std::move(frames), stale);
}

}  // namespace mono_pose_tracker
