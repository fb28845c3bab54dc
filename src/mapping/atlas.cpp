#include "mapping/atlas.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "keyframe_landmarks.h"
#include "mapping/map_covariances.h"
#include "mapping/track_extender.h"

namespace mono_pose_tracker {

std::vector<std::uint32_t> Atlas::inactive_ids() const {
  std::vector<std::uint32_t> ids;
  for (const auto& entry : inactive_) ids.push_back(entry.first);
  return ids;
}

std::vector<Map> Atlas::all_maps() const {
  std::map<std::uint32_t, const Map*> by_age;
  for (const auto& [id, inactive] : inactive_) by_age[id] = &inactive.map;
  if (!map().keyframes().empty()) by_age[present_.id] = &map();
  std::vector<Map> maps;
  for (const auto& entry : by_age) maps.push_back(*entry.second);
  return maps;
}

AtlasMap& Atlas::begin(std::uint32_t id, const MapperOptions& options) {
  present_ = AtlasMap();
  present_.id = id;
  present_.motions = MapMotions(options);
  return present_;
}

void Atlas::keep_present() {
  if (map().keyframes().empty()) return;
  present_.places->follow(map());  // the map may have changed since it was published
  const std::uint32_t id = present_.id;
  inactive_[id] = std::exchange(present_, AtlasMap());
  present_.id = id;
}

void Atlas::cap_inactive(std::size_t most_keyframes) {
  if (most_keyframes == 0) return;
  const auto size = [this](const auto& entry) {
    return entry.first == present_.id ? std::numeric_limits<std::size_t>::max()
                                      : entry.second.map.keyframes().size();
  };
  std::size_t keyframes = 0;
  for (const auto& entry : inactive_) keyframes += entry.second.map.keyframes().size();
  while (keyframes > most_keyframes && inactive_.size() > 1) {
    const auto smallest = std::min_element(inactive_.begin(), inactive_.end(),
                                           [&](const auto& a, const auto& b) { return size(a) < size(b); });
    keyframes -= size(*smallest);
    inactive_.erase(smallest);
  }
}

bool Atlas::resume(std::uint32_t id, bool keeps_present, const MapperOptions& options) {
  const auto found = inactive_.find(id);
  if (found == inactive_.end()) return false;
  AtlasMap resumed = std::move(found->second);
  inactive_.erase(found);
  resumed.motions = MapMotions(options);
  if (keeps_present) keep_present();
  present_ = std::move(resumed);
  return true;
}

void Atlas::join(std::uint32_t older_id, std::uint32_t newer_id, JoinedMaps joined,
                 const MapperOptions& options) {
  const auto find = [this](std::uint32_t id) -> const AtlasMap& {
    return id == present_.id ? present_ : inactive_.at(id);
  };
  const AtlasMap &older = find(older_id), &newer = find(newer_id);
  const MergedIds added = joined.added;
  AtlasMap result{older_id,   std::move(joined.map), older.places, older.covariances,
                  older.unit, MapMotions(options)};
  KeyframeCovariances of_newer = newer.covariances;
  scale_covariances([&](KeyframeId) { return joined.scale; }, &of_newer);
  KeyframeCovariances::Changes covariances;
  for (const auto& [id, covariance] : of_newer) {
    if (result.map.keyframe(id + added.keyframes)) covariances[id + added.keyframes] = covariance;
  }
  result.covariances.change(std::move(covariances));
  for (const auto& [id, corners] : newer.unit.markers)
    result.unit.markers.emplace(id + added.keyframes, corners);
  const ScaleSource unit_of_newer = newer.map.scale_source();
  const bool takes_unit =
      result.map.scale_source() == ScaleSource::kMapUnits && unit_of_newer != ScaleSource::kMapUnits;
  if (takes_unit && newer.unit.baseline) {
    result.unit.baseline = {newer.unit.baseline->first + added.keyframes,
                            newer.unit.baseline->second + added.keyframes};
  }
  present_ = std::move(result);
  inactive_.erase(older_id);
  inactive_.erase(newer_id);
  MapCorrection correction;
  correction.of_map = newer_id;
  correction.into_map = older_id;
  correction.added = added;
  correction.scale = joined.scale;
  add(std::move(correction));
  if (takes_unit)
    transform(Sim3(1 / joined.scale, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), unit_of_newer);
}

void Atlas::transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  present_.map.transform(new_from_map);
  scale_covariances([&](KeyframeId) { return new_from_map.scale; }, &present_.covariances);
  MapCorrection correction;
  correction.of_map = correction.into_map = present_.id;
  correction.scale = new_from_map.scale;
  add(std::move(correction));
  if (scale_source) present_.map.set_scale_source(*scale_source);
}

bool Atlas::renew_unit(const ScaleOptions& scale, const MapperLimits& limits, double least_change) {
  const std::optional<double> metres = present_.unit.metres(map().scale_source(), scale, limits, map());
  if (!metres || std::abs(*metres - 1) <= least_change) return false;
  transform(Sim3(*metres, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()));
  return true;
}

void Atlas::add_correction(const KeyframeChanges& changes) {
  MapCorrection correction;
  correction.of_map = correction.into_map = present_.id;
  correction.scale_of = scales_of(map(), changes);
  scale_covariances([&](KeyframeId id) { return correction.length_scale(id); }, &present_.covariances);
  add(std::move(correction));
}

void Atlas::add_other_geometry() {
  MapCorrection correction;
  correction.of_map = correction.into_map = present_.id;
  correction.other_geometry = true;
  add(std::move(correction));
}

void Atlas::remove_keyframe(KeyframeId id, const MapperOptions& options) {
  const std::vector<LandmarkId> seen = landmarks_of(*map().keyframe(id));
  const std::vector<KeyframeId> nearest = neighbors(map(), id, 1);
  present_.map.remove_keyframe(id,
                               nearest.empty() ? std::prev(map().keyframes().find(id))->first : nearest[0]);
  present_.motions.remove(id);
  present_.covariances.erase(id);
  TrackExtender(options, present_.motions.excluded(), &present_.map).cull(seen);
}

void Atlas::remove_keyframes(const std::set<KeyframeId>& ids, const MapperOptions& options) {
  std::set<KeyframeId> spared;  // two define the frame of the map
  for (auto keyframe = map().keyframes().begin(); keyframe != map().keyframes().end() && spared.size() < 2;
       ++keyframe)
    spared.insert(keyframe->first);
  for (const KeyframeId id : ids) {
    if (map().keyframe(id) && !spared.count(id)) remove_keyframe(id, options);
  }
  present_.unit.forget(ids, map());
}

void Atlas::add(MapCorrection correction) {
  correction.sequence = ++last_correction_;
  corrections_.push_back(std::make_shared<const MapCorrection>(std::move(correction)));
}

void Atlas::forget_old_corrections(std::size_t most) {
  if (corrections_.size() > most)
    corrections_.erase(corrections_.begin(), corrections_.end() - static_cast<std::ptrdiff_t>(most));
}

bool Atlas::bring_up_to_date(KeyframeCandidate* candidate) const {
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

}  // namespace mono_pose_tracker
