// The end of a recording: poses where the camera can hardly have been, and those that hang on too little.

#include <set>
#include <utility>
#include <vector>

#include "common/median.h"
#include "stray_frames.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

namespace {

// From the keyframes that see them: the median over the map.
double usual_distance(const TrackingMap& map) {
  std::vector<double> distances;
  for (const auto& entry : map.keyframes) {
    for (const LandmarkId l : entry.second.landmark_of_feature) {
      const auto landmark = map.landmarks.find(l);
      if (landmark == map.landmarks.end()) continue;
      distances.push_back((entry.second.camera_from_map * landmark->second).norm());
    }
  }
  return median(std::move(distances));
}

// The frames that stand on one of the keyframes: on what it was taken out for as well, and its own.
std::set<std::int64_t> frames_on(const TrackingMap& map, const FramePoses& poses,
                                 const std::set<KeyframeId>& keyframes) {
  const auto stands_on_one = [&](KeyframeId id) {
    return keyframes.count(living_ancestor(map.removed_keyframes, id)) > 0;
  };
  std::set<std::int64_t> frames;
  for (const auto& [index, pose] : poses.all()) {
    if (stands_on_one(pose.reference)) frames.insert(index);
  }
  for (const KeyframeId id : keyframes) frames.insert(map.keyframes.at(id).frame_index);
  for (const auto& [id, link] : map.removed_keyframes) {
    if (stands_on_one(id)) frames.insert(link.frame_index);
  }
  return frames;
}

void erase(const std::set<std::int64_t>& frames, FramePoses* poses) {
  for (const std::int64_t index : frames) poses->erase(index);
}

}  // namespace

// In the map's unit.
double Tracker::Impl::least_stray(const TrackingMap& map) const {
  constexpr double kLeastShare = 0.02;  // of the points' distance: one degree of parallax
  return kLeastShare * usual_distance(map);
}

std::set<std::int64_t> Tracker::Impl::find_strays() const {
  const TrackingMapPtr map = worker_.latest();
  return map ? stray_frames(trajectory(), least_stray(*map)) : std::set<std::int64_t>();
}

// Takes keyframes out of the map, which is finished anew. The frames that stood on them.
std::set<std::int64_t> Tracker::Impl::take_out(const std::set<KeyframeId>& keyframes) {
  const TrackingMapPtr map = worker_.latest();
  std::set<std::int64_t> frames = frames_on(*map, frames_[map->map_id], keyframes);
  worker_.mapper().remove_keyframes(keyframes);
  worker_.mapper().finish();
  follow_mapper();
  return frames;
}

// A keyframe that is wrong is right for the points that it alone vouches for, so that all of it goes before
// its image is posed anew.
std::set<std::int64_t> Tracker::Impl::take_out_strays() {
  std::set<std::int64_t> strays = find_strays();
  if (strays.empty() || options_.localize_only) return strays;
  const TrackingMapPtr map = worker_.latest();
  std::set<KeyframeId> wrong;
  for (const auto& [id, keyframe] : map->keyframes) {
    if (strays.count(keyframe.frame_index)) wrong.insert(id);
  }
  if (!wrong.empty()) strays.merge(take_out(wrong));
  return strays;
}

void Tracker::Impl::leave_out_strays() { erase(find_strays(), &frames_[worker_.latest()->map_id]); }

std::set<std::int64_t> Tracker::Impl::refine_with_graph() {
  if (options_.localize_only || !worker_.latest()) return {};
  const TrackingMapPtr before = worker_.latest();
  const std::set<KeyframeId> removed = worker_.mapper().refine_with_graph({});
  std::set<std::int64_t> frames;
  if (!removed.empty()) frames = frames_on(*before, frames_[before->map_id], removed);
  follow_mapper();
  erase(frames, &frames_[worker_.latest()->map_id]);
  return frames;
}

}  // namespace mono_pose_tracker
