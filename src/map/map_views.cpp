#include "mono_pose_tracker/map/map_views.h"

#include <optional>
#include <utility>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

namespace {

KeyframeView view_of(const Map& map, const Keyframe& keyframe) {
  KeyframeView view;
  view.id = keyframe.id;
  view.frame_index = keyframe.frame_index;
  view.stamp_ns = keyframe.stamp_ns;
  view.camera_from_map = keyframe.camera_from_map;
  view.image = keyframe.image;
  view.landmark_of_feature = keyframe.landmark_of_feature;
  for (const auto& [other, shared] : map.covisible(keyframe.id)) {
    view.covisible.push_back(other);
    view.shared_landmarks.push_back(shared);
  }
  return view;
}

}  // namespace

void MapViews::touch_all() {
  stale_keyframes_.clear();
  stale_landmarks_.clear();
  all_stale_ = true;
}

void MapViews::refresh(const Map& map) {
  if (std::exchange(all_stale_, false)) {
    keyframes_ = KeyframeViews();
    landmarks_ = LandmarkPositions();
    for (const auto& entry : map.keyframes()) stale_keyframes_.insert(entry.first);
    for (const auto& entry : map.landmarks()) stale_landmarks_.insert(entry.first);
  }
  KeyframeViews::Changes keyframes;
  for (const KeyframeId id : std::exchange(stale_keyframes_, {})) {
    const Keyframe* keyframe = map.keyframe(id);
    keyframes[id] = keyframe ? std::optional<KeyframeView>(view_of(map, *keyframe)) : std::nullopt;
  }
  keyframes_.change(std::move(keyframes));
  LandmarkPositions::Changes landmarks;
  for (const LandmarkId id : std::exchange(stale_landmarks_, {})) {
    const Landmark* landmark = map.landmark(id);
    landmarks[id] = landmark ? std::optional<Eigen::Vector3d>(landmark->x_in_map) : std::nullopt;
  }
  landmarks_.change(std::move(landmarks));
}

}  // namespace mono_pose_tracker
