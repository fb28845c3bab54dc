#include "mono_pose_tracker/map/map.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "mono_pose_tracker/map/map_views.h"

namespace mono_pose_tracker {
namespace {

std::vector<Observation>::iterator find_observation(Landmark& landmark, KeyframeId keyframe) {
  return std::lower_bound(landmark.observations.begin(), landmark.observations.end(), keyframe,
                          [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
}

// The pose that looks as before at what has moved.
Rigid3 moved(const Rigid3& camera_from_map, const Sim3& new_from_map) {
  Rigid3 camera_from_new;
  camera_from_new.rotation = (camera_from_map.rotation * new_from_map.rotation.conjugate()).normalized();
  camera_from_new.translation =
      -(camera_from_new.rotation * (new_from_map * camera_from_map.inverse().translation));
  return camera_from_new;
}

// Walks along links of removed keyframes must end.
void check_links(const std::map<KeyframeId, Keyframe>& keyframes,
                 const std::map<KeyframeId, KeyframeLink>& removed) {
  std::set<KeyframeId> ends;
  for (const auto& entry : removed) {
    if (keyframes.count(entry.first)) {
      throw std::invalid_argument("keyframe " + std::to_string(entry.first) + " is both present and removed");
    }
    std::set<KeyframeId> walked;
    KeyframeId id = entry.first;
    while (!keyframes.count(id) && !ends.count(id)) {
      const auto link = removed.find(id);
      if (link == removed.end() || !walked.insert(id).second) {
        throw std::invalid_argument("removed keyframe " + std::to_string(entry.first) +
                                    " is not linked to a present keyframe");
      }
      id = link->second.parent;
    }
    ends.merge(walked);
  }
}

// Half of the numbers: the rest is for keyframes and landmarks to come.
constexpr int kMostIds = std::numeric_limits<int>::max() / 2;

void check_id(int id) {
  if (id < 0 || id >= kMostIds)
    throw std::invalid_argument("the id " + std::to_string(id) + " is out of range");
}

}  // namespace

Map Map::restore(std::vector<Keyframe> keyframes, std::vector<Landmark> landmarks,
                 std::map<KeyframeId, KeyframeLink> removed, ScaleSource scale_source) {
  Map map;
  map.scale_source_ = scale_source;
  for (Keyframe& keyframe : keyframes) {
    check_id(keyframe.id);
    keyframe.landmark_of_feature.assign(keyframe.image->size(), kNoLandmark);
    map.next_keyframe_ = std::max(map.next_keyframe_, keyframe.id + 1);
    const KeyframeId id = keyframe.id;
    if (!map.keyframes_.emplace(id, std::move(keyframe)).second) {
      throw std::invalid_argument("keyframe " + std::to_string(id) + " occurs twice");
    }
  }
  map.removed_ = std::move(removed);
  for (const auto& entry : map.removed_) {
    check_id(entry.first);
    map.next_keyframe_ = std::max(map.next_keyframe_, entry.first + 1);
  }
  check_links(map.keyframes_, map.removed_);
  for (Landmark& landmark : landmarks) {
    const LandmarkId id = landmark.id;
    check_id(id);
    if (landmark.created_by >= 0) {
      check_id(landmark.created_by);
      map.next_keyframe_ = std::max(map.next_keyframe_, landmark.created_by + 1);
    }
    map.next_landmark_ = std::max(map.next_landmark_, id + 1);
    const auto first = map.first_landmark_.emplace(landmark.created_by, id).first;
    first->second = std::min(first->second, id);
    const std::vector<Observation> observations = std::exchange(landmark.observations, {});
    if (!map.landmarks_.emplace(id, std::move(landmark)).second) {
      throw std::invalid_argument("landmark " + std::to_string(id) + " occurs twice");
    }
    for (const Observation& o : observations) {
      const Keyframe* keyframe = map.keyframe(o.keyframe);
      const bool exists = keyframe && o.feature >= 0 && o.feature < keyframe->image->size();
      if (!exists || !map.add_observation(id, o.keyframe, o.feature)) {
        throw std::invalid_argument("landmark " + std::to_string(id) + " has an invalid observation");
      }
    }
  }
  map.forget_first_landmarks();
  map.views_.touch_all();
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
  first_landmark_[id] = next_landmark_;
  forget_first_landmarks();
  views_.touch_keyframe(id);
  return id;
}

LandmarkId Map::add_landmark(const Eigen::Vector3d& x_in_map) {
  const LandmarkId id = next_landmark_++;
  Landmark& landmark = landmarks_[id];
  landmark.id = id;
  landmark.x_in_map = x_in_map;
  landmark.created_by = next_keyframe_ - 1;
  views_.touch_landmark(id);
  return id;
}

bool Map::add_observation(LandmarkId landmark_id, KeyframeId keyframe_id, int feature) {
  Landmark* l = find_landmark(landmark_id);
  Keyframe* k = find_keyframe(keyframe_id);
  if (!l || !k || k->landmark_of_feature[feature] != kNoLandmark) return false;
  const auto place = find_observation(*l, keyframe_id);
  if (place != l->observations.end() && place->keyframe == keyframe_id) return false;
  count_shared(*l, keyframe_id, 1);
  l->observations.insert(place, {keyframe_id, feature});
  k->landmark_of_feature[feature] = landmark_id;
  views_.touch_keyframe(keyframe_id);
  return true;
}

void Map::remove_observation(LandmarkId landmark_id, KeyframeId keyframe_id) {
  Landmark* l = find_landmark(landmark_id);
  if (!l) return;
  const auto place = find_observation(*l, keyframe_id);
  if (place == l->observations.end() || place->keyframe != keyframe_id) return;
  keyframes_.at(keyframe_id).landmark_of_feature[place->feature] = kNoLandmark;
  views_.touch_keyframe(keyframe_id);
  l->observations.erase(place);
  count_shared(*l, keyframe_id, -1);
}

// The keyframe has begun (1) or ceased (-1) to see the landmark, among whose observations its own is not.
void Map::count_shared(const Landmark& landmark, KeyframeId keyframe, int change) {
  if (landmark.observations.empty()) return;
  std::map<KeyframeId, int>& own = shared_[keyframe];
  const auto count = [change](std::map<KeyframeId, int>& shared, KeyframeId other) {
    const auto entry = shared.emplace(other, 0).first;
    entry->second += change;
    if (entry->second == 0) shared.erase(entry);
  };
  for (const Observation& o : landmark.observations) {
    count(own, o.keyframe);
    count(shared_[o.keyframe], keyframe);
    views_.touch_keyframe(o.keyframe);
  }
}

void Map::remove_landmark(LandmarkId landmark_id) {
  const auto it = landmarks_.find(landmark_id);
  if (it == landmarks_.end()) return;
  while (!it->second.observations.empty()) {
    const Observation last = it->second.observations.back();
    keyframes_.at(last.keyframe).landmark_of_feature[last.feature] = kNoLandmark;
    views_.touch_keyframe(last.keyframe);
    it->second.observations.pop_back();
    count_shared(it->second, last.keyframe, -1);
  }
  landmarks_.erase(it);
  views_.touch_landmark(landmark_id);
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
  shared_.erase(keyframe_id);
  views_.touch_keyframe(keyframe_id);
}

void Map::forget_removed_keyframes(std::size_t most) {
  if (removed_.size() <= most) return;
  // Those that stay must not hang on one that goes.
  for (auto& [id, link] : removed_) {
    while (!keyframes_.count(link.parent)) {
      const KeyframeLink& next = removed_.at(link.parent);
      link.removed_from_parent = link.removed_from_parent * next.removed_from_parent;
      link.parent = next.parent;
    }
  }
  while (removed_.size() > most) removed_.erase(removed_.begin());
}

std::vector<LandmarkId> Map::landmark_ids() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& entry : landmarks_) ids.push_back(entry.first);
  std::sort(ids.begin(), ids.end());
  return ids;
}

void Map::forget_first_landmarks() {
  // The landmarks of the newest 16 keyframes are asked for.
  while (first_landmark_.size() > 16) first_landmark_.erase(first_landmark_.begin());
}

std::vector<LandmarkId> Map::landmarks_created_by(KeyframeId id) const {
  const auto first = first_landmark_.find(id);
  if (first == first_landmark_.end()) return {};
  const auto after = std::next(first);
  const LandmarkId end = after == first_landmark_.end() ? next_landmark_ : after->second;
  std::vector<LandmarkId> ids;
  for (LandmarkId l = first->second; l < end; ++l) {
    const Landmark* created = landmark(l);
    if (created && created->created_by == id) ids.push_back(l);
  }
  return ids;
}

const MapViews& Map::views() {
  views_.refresh(*this);
  return views_;
}

Map::Snapshot Map::snapshot() {
  views_.refresh(*this);
  return {views_.keyframes(), views_.landmarks(), removed_,       scale_source_,
          next_keyframe_,     next_landmark_,     first_landmark_};
}

Map Map::of(const Snapshot& snapshot) {
  Map map;
  map.removed_ = snapshot.removed;
  map.scale_source_ = snapshot.scale_source;
  map.next_keyframe_ = snapshot.next_keyframe;
  map.next_landmark_ = snapshot.next_landmark;
  map.first_landmark_ = snapshot.first_landmark;
  for (const auto& [id, x_in_map] : snapshot.landmarks) {
    KeyframeId created_by = -1;
    for (const auto& [keyframe, first] : snapshot.first_landmark) {
      if (first <= id) created_by = keyframe;
    }
    map.landmarks_[id] = {id, x_in_map, {}, created_by};
  }
  for (const auto& [id, view] : snapshot.keyframes) {
    map.keyframes_[id] = {id,
                          view.frame_index,
                          view.stamp_ns,
                          view.camera_from_map,
                          view.image,
                          std::vector<LandmarkId>(view.landmark_of_feature.size(), kNoLandmark)};
    for (std::size_t f = 0; f < view.landmark_of_feature.size(); ++f) {
      if (view.landmark_of_feature[f] != kNoLandmark)
        map.add_observation(view.landmark_of_feature[f], id, static_cast<int>(f));
    }
  }
  map.views_.touch_all();
  return map;
}

Keyframe* Map::find_keyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const Keyframe* Map::keyframe(KeyframeId id) const { return const_cast<Map*>(this)->find_keyframe(id); }

Landmark* Map::find_landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

const Landmark* Map::landmark(LandmarkId id) const { return const_cast<Map*>(this)->find_landmark(id); }

void Map::set_pose(KeyframeId id, const Rigid3& camera_from_map) {
  Keyframe* keyframe = find_keyframe(id);
  if (!keyframe) return;
  keyframe->camera_from_map = camera_from_map;
  views_.touch_keyframe(id);
}

void Map::set_position(LandmarkId id, const Eigen::Vector3d& x_in_map) {
  Landmark* landmark = find_landmark(id);
  if (!landmark) return;
  landmark->x_in_map = x_in_map;
  views_.touch_landmark(id);
}

std::vector<std::pair<KeyframeId, int>> Map::covisible(KeyframeId keyframe_id) const {
  const auto shared = shared_.find(keyframe_id);
  if (shared == shared_.end()) return {};
  std::vector<std::pair<KeyframeId, int>> result(shared->second.begin(), shared->second.end());
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first > b.first;
  });
  return result;
}

int Map::shared(KeyframeId a, KeyframeId b) const {
  const auto of_a = shared_.find(a);
  if (of_a == shared_.end()) return 0;
  const auto of_both = of_a->second.find(b);
  return of_both == of_a->second.end() ? 0 : of_both->second;
}

bool Map::camera_from_map(KeyframeId id, Rigid3* camera_from_map) const {
  return resolve_keyframe(keyframes_, removed_, id, camera_from_map);
}

void Map::rescale(double scale) {
  views_.touch_all();
  for (auto& entry : keyframes_) entry.second.camera_from_map.translation *= scale;
  for (auto& entry : landmarks_) entry.second.x_in_map *= scale;
  for (auto& entry : removed_) entry.second.removed_from_parent.translation *= scale;
}

void Map::transform(const Sim3& new_from_map) {
  views_.touch_all();
  for (auto& entry : keyframes_) {
    entry.second.camera_from_map = moved(entry.second.camera_from_map, new_from_map);
  }
  for (auto& entry : landmarks_) entry.second.x_in_map = new_from_map * entry.second.x_in_map;
  for (auto& entry : removed_) entry.second.removed_from_parent.translation *= new_from_map.scale;
}

void Map::apply(const std::map<KeyframeId, Sim3>& new_from_map) {
  views_.touch_all();
  for (auto& [id, link] : removed_) {
    const auto change = new_from_map.find(living_ancestor(removed_, id));
    if (change != new_from_map.end()) link.removed_from_parent.translation *= change->second.scale;
  }
  for (auto& [id, landmark] : landmarks_) {
    if (landmark.observations.empty()) continue;
    const auto change = new_from_map.find(landmark.observations.front().keyframe);
    if (change != new_from_map.end()) landmark.x_in_map = change->second * landmark.x_in_map;
  }
  for (const auto& [id, change] : new_from_map) {
    if (Keyframe* keyframe = find_keyframe(id)) {
      keyframe->camera_from_map = moved(keyframe->camera_from_map, change);
    }
  }
}

bool Map::has_ids_for(const Map& other) const {
  return other.next_keyframe_ <= kMostIds - next_keyframe_ &&
         other.next_landmark_ <= kMostIds - next_landmark_;
}

MergedIds Map::merge(Map other, const Sim3& map_from_other) {
  if (!has_ids_for(other)) throw std::length_error("the maps have too many ids to be merged");
  other.transform(map_from_other);
  const MergedIds added{next_keyframe_, next_landmark_};
  for (const auto& [id, landmark] : other.first_landmark_) {
    first_landmark_[id + added.keyframes] = landmark + added.landmarks;
  }
  for (auto& [id, keyframe] : other.keyframes_) {
    keyframe.id += added.keyframes;
    keyframe.landmark_of_feature.assign(keyframe.landmark_of_feature.size(), kNoLandmark);
    keyframes_.emplace(keyframe.id, std::move(keyframe));
  }
  for (auto& [id, link] : other.removed_) {
    link.parent += added.keyframes;
    removed_.emplace(id + added.keyframes, link);
  }
  next_keyframe_ += other.next_keyframe_;
  for (const LandmarkId id : other.landmark_ids()) {
    Landmark& landmark = other.landmarks_.at(id);
    Landmark& mine = landmarks_[id + added.landmarks];
    mine.id = id + added.landmarks;
    mine.x_in_map = landmark.x_in_map;
    mine.created_by = landmark.created_by < 0 ? -1 : landmark.created_by + added.keyframes;
    for (const Observation& o : landmark.observations) {
      add_observation(mine.id, o.keyframe + added.keyframes, o.feature);
    }
  }
  next_landmark_ += other.next_landmark_;
  views_.touch_all();
  return added;
}

void Map::shift_frame_indices(std::int64_t offset) {
  views_.touch_all();
  for (auto& entry : keyframes_) entry.second.frame_index += offset;
  for (auto& entry : removed_) entry.second.frame_index += offset;
}

void Map::check_covisibility() const {
  std::unordered_map<KeyframeId, std::map<KeyframeId, int>> counted;
  for (const auto& entry : landmarks_) {
    for (const Observation& a : entry.second.observations) {
      for (const Observation& b : entry.second.observations) {
        if (a.keyframe != b.keyframe) ++counted[a.keyframe][b.keyframe];
      }
    }
  }
  for (const auto& entry : keyframes_) {
    const auto kept = shared_.find(entry.first);
    if (counted[entry.first] != (kept == shared_.end() ? std::map<KeyframeId, int>() : kept->second)) {
      throw std::logic_error("keyframe " + std::to_string(entry.first) +
                             " has wrong counts of shared landmarks");
    }
  }
}

void Map::check() const {
  check_covisibility();
  for (const auto& [id, k] : keyframes_) {
    if (static_cast<int>(k.landmark_of_feature.size()) != k.image->size()) {
      throw std::logic_error("keyframe " + std::to_string(id) +
                             " and its image differ in their number of features");
    }
    for (std::size_t f = 0; f < k.landmark_of_feature.size(); ++f) {
      const LandmarkId l = k.landmark_of_feature[f];
      if (l == kNoLandmark) continue;
      const Landmark* seen = landmark(l);
      const bool known = seen && std::any_of(seen->observations.begin(), seen->observations.end(),
                                             [&, id = id](const auto& o) {
                                               return o.keyframe == id && o.feature == static_cast<int>(f);
                                             });
      if (!known)
        throw std::logic_error("keyframe " + std::to_string(id) +
                               " observes a landmark that does not list this observation");
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
                               " lists an observation that its keyframe does not have");
      }
    }
  }
}

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
