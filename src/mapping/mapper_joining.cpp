// The part of the Mapper that keeps several maps, merges them where they can be aligned, and transforms the
// present one.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "keyframe_places.h"
#include "mapping/mapper.h"
#include "optimization/map_adjustment.h"
#include "sorted_unique.h"

namespace mono_pose_tracker {

namespace {

// Number of landmarks observed from both sides of the boundary: by keyframes before and from `first_new`.
int points_across(const Map& map, KeyframeId first_new) {
  int count = 0;
  for (const auto& entry : map.landmarks()) {
    const std::vector<Observation>& seen = entry.second.observations;
    count += seen.size() > 1 && seen.front().keyframe < first_new && seen.back().keyframe >= first_new;
  }
  return count;
}

// Keyframes with the same image in both maps: (old map's, new map's).
std::vector<std::pair<KeyframeId, KeyframeId>> same_images(const Map& map, KeyframeId first_new) {
  std::map<std::int64_t, KeyframeId> old_of_frame;
  std::vector<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (id < first_new) {
      old_of_frame[keyframe.frame_index] = id;
      continue;
    }
    const auto old = old_of_frame.find(keyframe.frame_index);
    if (old == old_of_frame.end()) continue;
    // The features differ: the object was masked differently.
    if (map.keyframe(old->second)->image->size() == keyframe.image->size())
      pairs.emplace_back(old->second, id);
  }
  return pairs;
}

// Merges two keyframes of the same image feature by feature; one of them remains.
void unite(KeyframeId old_id, KeyframeId new_id, Map* map) {
  const std::vector<LandmarkId> of_new = map->keyframe(new_id)->landmark_of_feature;
  for (std::size_t f = 0; f < of_new.size(); ++f) {
    if (of_new[f] == kNoLandmark) continue;
    const LandmarkId held = map->keyframe(old_id)->landmark_of_feature[f];
    if (held == kNoLandmark) {
      map->add_observation(of_new[f], old_id, static_cast<int>(f));
    } else {
      map->merge_landmarks(of_new[f], held);
    }
  }
  // Frames relative to the new keyframe take the pose of the old one.
  map->set_pose(new_id, map->keyframe(old_id)->camera_from_map);
  map->remove_keyframe(new_id, old_id);
}

// Two maps in the frame and scale of the older one.
struct JoinedMaps {
  Map map;
  MergedIds added;                   // offsets of the newer map's ids
  double scale = 1;                  // of the newer one
  std::vector<KeyframeId> boundary;  // keyframes that connect the two maps
};

JoinedMaps join_maps(const Map& older, const Map& newer, const MapAlignment& alignment) {
  JoinedMaps joined;
  joined.map = older;
  joined.scale = alignment.other_from_map.scale;
  joined.added = joined.map.merge(newer, alignment.other_from_map);
  for (const auto& [own, theirs] : same_landmarks(newer, alignment.found)) {
    joined.map.merge_landmarks(own + joined.added.landmarks, theirs);
  }
  for (const auto& [id, matches] : alignment.found) {
    const KeyframeId keyframe = id + joined.added.keyframes;
    joined.boundary.push_back(keyframe);
    for (const auto& [feature, landmark] : matches) joined.map.add_observation(landmark, keyframe, feature);
  }
  for (const auto& [old_id, new_id] : same_images(joined.map, joined.added.keyframes)) {
    unite(old_id, new_id, &joined.map);
    std::replace(joined.boundary.begin(), joined.boundary.end(), new_id, old_id);
    joined.boundary.push_back(old_id);
  }
  return joined;
}

}  // namespace

void Mapper::keep_present() {
  if (map_.keyframes().empty()) return;
  places_->follow(map_);  // the map may have changed since it was published
  inactive_[map_id_] = {std::move(map_), std::move(places_), std::move(covariances_), std::move(unit_)};
  map_ = Map();
}

// Caps the inactive maps of a capped map: the smallest ones are dropped. The map that was just left stays, as
// the new one may fail.
void Mapper::cap_inactive_maps() {
  const auto most = static_cast<std::size_t>(options_.mapping.max_keyframes);
  if (most == 0) return;
  const auto size = [this](const auto& entry) {
    return entry.first == map_id_ ? std::numeric_limits<std::size_t>::max()
                                  : entry.second.map.keyframes().size();
  };
  std::size_t keyframes = 0;
  for (const auto& entry : inactive_) keyframes += entry.second.map.keyframes().size();
  while (keyframes > most && inactive_.size() > 1) {
    const auto smallest = std::min_element(inactive_.begin(), inactive_.end(),
                                           [&](const auto& a, const auto& b) { return size(a) < size(b); });
    keyframes -= size(*smallest);
    inactive_.erase(smallest);
  }
}

bool Mapper::resume(std::uint32_t map_id, bool keep_this, std::uint32_t epoch) {
  if (map_id == map_id_ && !map_.keyframes().empty()) {
    drop_background_job();  // it belongs to another epoch
    epoch_ = epoch;
    publish();
    return true;
  }
  const auto kept = inactive_.find(map_id);
  if (kept == inactive_.end()) {
    drop_background_job();
    epoch_ = epoch;
    publish();
    return false;
  }
  InactiveMap resumed = std::move(kept->second);
  inactive_.erase(kept);
  if (keep_this) keep_present();
  map_ = std::move(resumed.map);
  reset_map_state();
  map_state_.merged_up_to = map_.keyframes().rbegin()->first;  // up to the last adjustment, approximately
  places_ = std::move(resumed.places);
  covariances_ = std::move(resumed.covariances);
  unit_ = std::move(resumed.unit);
  map_id_ = map_id;
  epoch_ = epoch;
  publish();
  return true;
}

std::vector<std::uint32_t> Mapper::inactive_maps() const {
  std::vector<std::uint32_t> ids;
  for (const auto& entry : inactive_) ids.push_back(entry.first);
  return ids;
}

std::vector<Map> Mapper::all_maps() const {
  std::map<std::uint32_t, const Map*> by_age;
  for (const auto& entry : inactive_) by_age[entry.first] = &entry.second.map;
  if (!map_.keyframes().empty()) by_age[map_id_] = &map_;
  std::vector<Map> maps;
  maps.reserve(by_age.size());
  for (const auto& entry : by_age) maps.push_back(*entry.second);
  return maps;
}

// Updates the ids and lengths of a candidate that was registered earlier. Returns false where it was
// registered in a geometry that the map no longer has, which makes its pose invalid.
bool Mapper::bring_up_to_date(KeyframeCandidate* candidate) const {
  for (const auto& correction : corrections_) {
    if (correction->sequence <= candidate->corrections || correction->of_map != candidate->map_id) continue;
    if (correction->other_geometry) return false;
    candidate->map_id = correction->into_map;
    candidate->reference += correction->added.keyframes;
    candidate->camera_from_reference.translation *= correction->length_scale(candidate->reference);
    for (FrameObservation& o : candidate->observations) o.landmark += correction->added.landmarks;
  }
  return true;
}

void Mapper::add_correction(MapCorrection correction) {
  correction.sequence = ++last_correction_;
  corrections_.push_back(std::make_shared<const MapCorrection>(std::move(correction)));
}

// For endless runs. While no keyframes are inserted all corrections are kept: they may not have been read
// yet.
void Mapper::forget_old_corrections() {
  const auto most = static_cast<std::ptrdiff_t>(limits_.kept_corrections);
  const auto known = static_cast<std::ptrdiff_t>(corrections_.size());
  if (known > most) corrections_.erase(corrections_.begin(), corrections_.end() - most);
}

std::optional<MapAlignment> Mapper::find_alignment(const InactiveMap& other, KeyframeId keyframe) const {
  std::vector<KeyframeId> keyframes = neighbors(keyframe, limits_.other_views);
  keyframes.insert(keyframes.begin(), keyframe);
  for (const KeyframeId place : other.places->find(map_.keyframe(keyframe)->image->set, kBestPlaces)) {
    if (auto alignment = align_maps(options_, map_, keyframes, other.map, place, limits_.joiner))
      return alignment;
  }
  return std::nullopt;
}

bool Mapper::join_where_aligned(KeyframeId newest) {
  for (const std::uint32_t id : inactive_maps()) {
    const std::optional<MapAlignment> alignment = find_alignment(inactive_.at(id), newest);
    if (!alignment) continue;
    if (id < map_id_ ? join(id, *alignment) : join_newer(id, *alignment)) return true;
  }
  return false;
}

// The present map is the older one (switched to, or loaded), and its frame stays.
bool Mapper::join_newer(std::uint32_t inactive_id, const MapAlignment& alignment) {
  if (alignment.found_in_other.empty()) return false;
  const std::uint32_t older = map_id_;
  const MapState previous_state = map_state_;  // restored where the merge fails
  resume(inactive_id, true, epoch_);
  if (join(older, alignment.inverse())) return true;
  resume(older, true, epoch_);
  map_state_ = previous_state;
  return false;
}

// Merges two maps in the frame and scale of the older one. Returns false and changes nothing when fewer than
// half of the shared landmarks remain after the adjustment, as for a loop.
bool Mapper::join(std::uint32_t inactive_id, const MapAlignment& alignment) {
  if (!inactive_.at(inactive_id).map.has_ids_for(map_)) return false;
  JoinedMaps joined = join_maps(inactive_.at(inactive_id).map, map_, alignment);
  const int shared = points_across(joined.map, joined.added.keyframes);
  auto excluded = std::exchange(map_state_.excluded, {});  // their ids are invalid if the merge succeeds
  auto unmasked = std::exchange(map_state_.unmasked, {});
  Map apart = std::exchange(map_, std::move(joined.map));
  adjust_boundary(joined.boundary);
  const bool is_all_shared = map_.keyframes().rbegin()->first < joined.added.keyframes;
  if (!is_all_shared &&
      points_across(map_, joined.added.keyframes) < std::max(options_.min_inliers, shared / 2)) {
    map_ = std::move(apart);
    map_state_.excluded = std::move(excluded);
    map_state_.unmasked = std::move(unmasked);
    return false;
  }
  become_part_of(inactive_id, joined.added, joined.scale, apart.scale_source());
  return true;
}

// State of the merged map is converted to the ids and scale of the result. The unit is the older map's if it
// has one, else the newer one's.
void Mapper::become_part_of(std::uint32_t inactive_id, const MergedIds& added, double scale,
                            ScaleSource own_source) {
  MapCorrection correction;
  correction.of_map = map_id_;
  correction.into_map = inactive_id;
  correction.added = added;
  correction.scale = scale;
  add_correction(std::move(correction));
  map_id_ = inactive_id;
  scale_covariances([&](KeyframeId) { return scale; });
  KeyframeCovariances covariances = inactive_.at(inactive_id).covariances;
  KeyframeCovariances::Changes own;
  for (const auto& [id, covariance] : covariances_) {
    if (map_.keyframe(id + added.keyframes)) own[id + added.keyframes] = covariance;
  }
  covariances.change(std::move(own));
  reset_map_state();
  covariances_ = std::move(covariances);
  places_ = inactive_.at(inactive_id).places;
  const UnitSource own_unit = std::exchange(unit_, inactive_.at(inactive_id).unit);
  inactive_.erase(inactive_id);
  for (const auto& [id, corners] : own_unit.markers) unit_.markers.emplace(id + added.keyframes, corners);
  if (map_.scale_source() != ScaleSource::kMapUnits || own_source == ScaleSource::kMapUnits) return;
  if (own_unit.baseline) {
    unit_.baseline = {own_unit.baseline->first + added.keyframes,
                      own_unit.baseline->second + added.keyframes};
  }
  transform(Sim3(1 / scale, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), own_source);
}

// Adjusts with a wide loss, so that the merged tracks have an effect before anything is culled.
void Mapper::adjust_boundary(const std::vector<KeyframeId>& boundary) {
  std::vector<KeyframeId> window = boundary;
  for (const KeyframeId id : boundary) {
    for (const KeyframeId n : neighbors(id, 2 * options_.mapping.window_keyframes)) window.push_back(n);
  }
  window = sorted_unique(std::move(window));
  const BundleOptions& bundle = options_.bundle;
  const int fixed = held_keyframes(options_.mapping.window_keyframes);
  count(adjust_keyframes(with_wide_loss(bundle), window, fixed, options_.mapping.window_landmarks, &map_));
  for (const KeyframeId id : boundary) {
    fuse(id, std::nullopt);
    create_landmarks(id, neighbors(id, options_.mapping.matching_keyframes));
  }
  count(adjust_keyframes(bundle, window, fixed, options_.mapping.window_landmarks, &map_));
  cull_observations(map_.landmark_ids());
}

void Mapper::transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  if (map_.keyframes().empty()) return;
  move_map(new_from_map);
  if (scale_source) map_.set_scale_source(*scale_source);
  publish();
}

void Mapper::move_map(const Sim3& new_from_map) {
  drop_background_job();  // it works on the map before the change
  map_.transform(new_from_map);
  scale_covariances([&](KeyframeId) { return new_from_map.scale; });
  MapCorrection correction;
  correction.of_map = correction.into_map = map_id_;
  correction.scale = new_from_map.scale;
  add_correction(std::move(correction));
}

// A failed pair is not tried again until a third map is merged with one of them.
void Mapper::join_rest() {
  std::set<std::pair<std::uint32_t, std::uint32_t>> apart;  // (newer, older)
  while (join_any(&apart)) {
  }
  publish();
}

bool Mapper::join_any(std::set<std::pair<std::uint32_t, std::uint32_t>>* apart) {
  std::vector<std::uint32_t> ids = inactive_maps();
  ids.push_back(map_id_);
  std::sort(ids.begin(), ids.end());
  for (std::size_t newer = ids.size() - 1; newer > 0; --newer) {
    resume(ids[newer], true, epoch_);
    for (std::size_t older = 0; older < newer; ++older) {
      if (apart->count({ids[newer], ids[older]})) continue;
      if (!join_anywhere(ids[older])) {
        apart->insert({ids[newer], ids[older]});
        continue;
      }
      for (auto pair = apart->begin(); pair != apart->end();) {
        const bool has_grown = pair->first == ids[older] || pair->second == ids[older];
        pair = has_grown ? apart->erase(pair) : std::next(pair);
      }
      return true;
    }
  }
  return false;
}

// Merges by the view graph between the two.
bool Mapper::join_anywhere(std::uint32_t inactive_id) {
  const InactiveMap& kept = inactive_.at(inactive_id);
  const std::optional<MapAlignment> alignment =
      align_maps(options_, map_, kept.map, *kept.places, &view_graph(), limits_.joiner);
  return alignment && join(inactive_id, *alignment);
}

}  // namespace mono_pose_tracker
