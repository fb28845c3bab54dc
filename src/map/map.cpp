#include "mono_pose_tracker/map/map.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace mono_pose_tracker {

namespace {

std::vector<Observation>::iterator find_observation(Landmark& landmark, KeyframeId keyframe) {
  return std::lower_bound(landmark.observations.begin(), landmark.observations.end(), keyframe,
                          [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
}

// Walks along links of removed keyframes must end.
void check_links(const std::map<KeyframeId, Keyframe>& keyframes,
                 const std::map<KeyframeId, KeyframeLink>& removed) {
  std::set<KeyframeId> ends;
  for (const auto& entry : removed) {
    if (keyframes.count(entry.first)) {
      throw std::invalid_argument("keyframe " + std::to_string(entry.first) + " is both there and removed");
    }
    std::set<KeyframeId> walked;
    KeyframeId id = entry.first;
    while (!keyframes.count(id) && !ends.count(id)) {
      const auto link = removed.find(id);
      if (link == removed.end() || !walked.insert(id).second) {
        throw std::invalid_argument("removed keyframe " + std::to_string(entry.first) + " leads nowhere");
      }
      id = link->second.parent;
    }
    ends.merge(walked);
  }
}

}  // namespace

Map Map::restore(std::vector<Keyframe> keyframes, std::vector<Landmark> landmarks,
                 std::map<KeyframeId, KeyframeLink> removed, ScaleSource scale_source) {
  Map map;
  map.scale_source_ = scale_source;
  for (Keyframe& keyframe : keyframes) {
    keyframe.landmark_of_feature.assign(keyframe.image->size(), kNoLandmark);
    map.next_keyframe_ = std::max(map.next_keyframe_, keyframe.id + 1);
    const KeyframeId id = keyframe.id;
    if (!map.keyframes_.emplace(id, std::move(keyframe)).second) {
      throw std::invalid_argument("keyframe " + std::to_string(id) + " is there twice");
    }
  }
  map.removed_ = std::move(removed);
  for (const auto& entry : map.removed_) map.next_keyframe_ = std::max(map.next_keyframe_, entry.first + 1);
  check_links(map.keyframes_, map.removed_);
  for (Landmark& landmark : landmarks) {
    const LandmarkId id = landmark.id;
    map.next_landmark_ = std::max(map.next_landmark_, id + 1);
    const std::vector<Observation> observations = std::exchange(landmark.observations, {});
    if (!map.landmarks_.emplace(id, std::move(landmark)).second) {
      throw std::invalid_argument("landmark " + std::to_string(id) + " is there twice");
    }
    for (const Observation& o : observations) {
      const Keyframe* keyframe = map.keyframe(o.keyframe);
      const bool exists = keyframe && o.feature >= 0 && o.feature < keyframe->image->size();
      if (!exists || !map.add_observation(id, o.keyframe, o.feature)) {
        throw std::invalid_argument("landmark " + std::to_string(id) + " has an observation that can't be");
      }
    }
  }
  return map;
}

KeyframeId Map::add_keyframe(std::int64_t frame_index, std::int64_t stamp_ns, const Rigid3& camera_from_map,
                             ImageFeaturesPtr image) {
  const KeyframeId id = next_keyframe_++;
  Keyframe& keyframe = keyframes_[id];
  keyframe.id = id;
  keyframe.frame_index = frame_index;
  keyframe.stamp_ns = stamp_ns;
  keyframe.camera_from_map = camera_from_map;
  keyframe.landmark_of_feature.assign(image->size(), kNoLandmark);
  keyframe.image = std::move(image);
  return id;
}

LandmarkId Map::add_landmark(const Eigen::Vector3d& x_in_map) {
  const LandmarkId id = next_landmark_++;
  Landmark& landmark = landmarks_[id];
  landmark.id = id;
  landmark.x_in_map = x_in_map;
  landmark.created_by = next_keyframe_ - 1;
  return id;
}

bool Map::add_observation(LandmarkId landmark_id, KeyframeId keyframe_id, int feature) {
  Landmark* l = landmark(landmark_id);
  Keyframe* k = keyframe(keyframe_id);
  if (!l || !k || k->landmark_of_feature[feature] != kNoLandmark) return false;
  const auto place = find_observation(*l, keyframe_id);
  if (place != l->observations.end() && place->keyframe == keyframe_id) return false;
  l->observations.insert(place, {keyframe_id, feature});
  k->landmark_of_feature[feature] = landmark_id;
  return true;
}

void Map::remove_observation(LandmarkId landmark_id, KeyframeId keyframe_id) {
  Landmark* l = landmark(landmark_id);
  if (!l) return;
  const auto place = find_observation(*l, keyframe_id);
  if (place == l->observations.end() || place->keyframe != keyframe_id) return;
  keyframes_.at(keyframe_id).landmark_of_feature[place->feature] = kNoLandmark;
  l->observations.erase(place);
}

void Map::remove_landmark(LandmarkId landmark_id) {
  const auto it = landmarks_.find(landmark_id);
  if (it == landmarks_.end()) return;
  for (const Observation& o : it->second.observations) {
    keyframes_.at(o.keyframe).landmark_of_feature[o.feature] = kNoLandmark;
  }
  landmarks_.erase(it);
}

void Map::merge_landmarks(LandmarkId from, LandmarkId into) {
  if (from == into || !landmark(from) || !landmark(into)) return;
  const std::vector<Observation> observations = landmark(from)->observations;
  remove_landmark(from);
  for (const Observation& o : observations) add_observation(into, o.keyframe, o.feature);
}

void Map::remove_keyframe(KeyframeId keyframe_id, KeyframeId parent) {
  const auto it = keyframes_.find(keyframe_id);
  if (it == keyframes_.end() || keyframe_id == parent || !keyframe(parent)) return;
  for (const LandmarkId l : std::vector<LandmarkId>(it->second.landmark_of_feature)) {
    if (l != kNoLandmark) remove_observation(l, keyframe_id);
  }
  removed_[keyframe_id] = {it->second.frame_index, parent,
                           it->second.camera_from_map * keyframe(parent)->camera_from_map.inverse()};
  keyframes_.erase(it);
}

std::vector<LandmarkId> Map::landmark_ids() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& entry : landmarks_) ids.push_back(entry.first);
  std::sort(ids.begin(), ids.end());
  return ids;
}

Keyframe* Map::keyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const Keyframe* Map::keyframe(KeyframeId id) const { return const_cast<Map*>(this)->keyframe(id); }

Landmark* Map::landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

const Landmark* Map::landmark(LandmarkId id) const { return const_cast<Map*>(this)->landmark(id); }

std::vector<std::pair<KeyframeId, int>> Map::covisible(KeyframeId keyframe_id) const {
  std::map<KeyframeId, int> shared;
  if (const Keyframe* k = keyframe(keyframe_id)) {
    for (const LandmarkId l : k->landmark_of_feature) {
      if (l == kNoLandmark) continue;
      for (const Observation& o : landmarks_.at(l).observations) ++shared[o.keyframe];
    }
  }
  shared.erase(keyframe_id);
  std::vector<std::pair<KeyframeId, int>> result(shared.begin(), shared.end());
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first > b.first;
  });
  return result;
}

bool Map::camera_from_map(KeyframeId id, Rigid3* camera_from_map) const {
  return resolve_keyframe(keyframes_, removed_, id, camera_from_map);
}

void Map::rescale(double scale) {
  for (auto& entry : keyframes_) entry.second.camera_from_map.translation *= scale;
  for (auto& entry : landmarks_) entry.second.x_in_map *= scale;
  for (auto& entry : removed_) entry.second.removed_from_parent.translation *= scale;
}

void Map::shift_frame_indices(std::int64_t offset) {
  for (auto& entry : keyframes_) entry.second.frame_index += offset;
  for (auto& entry : removed_) entry.second.frame_index += offset;
}

void Map::check() const {
  for (const auto& [id, k] : keyframes_) {
    if (static_cast<int>(k.landmark_of_feature.size()) != k.image->size()) {
      throw std::logic_error("keyframe " + std::to_string(id) +
                             " has another number of features than its image");
    }
    for (std::size_t f = 0; f < k.landmark_of_feature.size(); ++f) {
      const LandmarkId l = k.landmark_of_feature[f];
      if (l == kNoLandmark) continue;
      const Landmark* seen = landmark(l);
      const bool known =
          seen && std::any_of(seen->observations.begin(), seen->observations.end(), [&](const auto& o) {
            return o.keyframe == id && o.feature == static_cast<int>(f);
          });
      if (!known)
        throw std::logic_error("keyframe " + std::to_string(id) + " sees a landmark that does not know it");
    }
  }
  for (const auto& [id, l] : landmarks_) {
    for (std::size_t i = 0; i < l.observations.size(); ++i) {
      const Observation& o = l.observations[i];
      if (i > 0 && l.observations[i - 1].keyframe >= o.keyframe) {
        throw std::logic_error("landmark " + std::to_string(id) + " has observations out of order");
      }
      const Keyframe* k = keyframe(o.keyframe);
      if (!k || k->landmark_of_feature[o.feature] != id) {
        throw std::logic_error("landmark " + std::to_string(id) +
                               " is seen by a keyframe that does not know it");
      }
    }
  }
}

}  // namespace mono_pose_tracker
