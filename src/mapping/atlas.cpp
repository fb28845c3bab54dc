#include "mapping/atlas.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "common/rotation.h"
#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "mapping/mapper_limits.h"
#include "mapping/track_extender.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

void update_covariances(const MapperOptions& options, const Map& map, const std::vector<KeyframeId>& window,
                        KeyframeCovariances* covariances) {
  const auto found = keyframe_covariances(
      window, held_keyframes(options.mapping.window_keyframes),
      std::min(kMapperLimits.covariance_landmarks, options.mapping.window_landmarks), map);
  KeyframeCovariances::Changes changes;
  for (const auto& [id, own] : found) {
    Eigen::Matrix<double, 6, 6> covariance = own;
    for (const KeyframeId other : neighbors(map, id, static_cast<int>(map.keyframes().size()))) {
      const auto known = covariances->find(other);
      if (found.count(other) > 0 || known == covariances->end()) continue;
      const Eigen::Matrix<double, 6, 6> carried =
          adjoint(map.keyframe(id)->camera_from_map * map.keyframe(other)->camera_from_map.inverse());
      covariance += carried * known->second * carried.transpose();
      break;
    }
    changes[id] = covariance;
  }
  covariances->change(std::move(changes));
}

KeyframeCovariances find_covariances(const MapperOptions& options, const Map& map) {
  KeyframeCovariances covariances;
  const auto size = static_cast<std::size_t>(options.mapping.window_keyframes);
  std::vector<KeyframeId> window;
  for (const auto& entry : map.keyframes()) {
    window.push_back(entry.first);
    if (window.size() < size && entry.first != map.keyframes().rbegin()->first) continue;
    update_covariances(options, map, window, &covariances);
    window.clear();
  }
  return covariances;
}

void scale_covariances(const std::function<double(KeyframeId)>& scale_of, KeyframeCovariances* covariances) {
  KeyframeCovariances::Changes changes;
  for (const auto& [id, covariance] : *covariances) {
    Eigen::Matrix<double, 6, 6>& scaled = changes[id].emplace(covariance);
    scaled.topRows<3>() *= scale_of(id);
    scaled.leftCols<3>() *= scale_of(id);
  }
  covariances->change(std::move(changes));
}

std::vector<std::uint32_t> Atlas::inactive_ids() const {
  std::vector<std::uint32_t> ids;
  for (const auto& entry : inactive_) ids.push_back(entry.first);
  return ids;
}

std::vector<Map> Atlas::all_maps() const {
  std::map<std::uint32_t, const Map*> by_age;
  for (const auto& [id, inactive] : inactive_) by_age[id] = &inactive->map;
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
  inactive_[id] = std::make_shared<const AtlasMap>(std::exchange(present_, AtlasMap()));
  present_.id = id;
}

void Atlas::cap_inactive(std::size_t most_keyframes) {
  if (most_keyframes == 0) return;
  const auto size = [this](const auto& entry) {
    return entry.first == present_.id ? std::numeric_limits<std::size_t>::max()
                                      : entry.second->map.keyframes().size();
  };
  std::size_t keyframes = 0;
  for (const auto& entry : inactive_) keyframes += entry.second->map.keyframes().size();
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
  AtlasMap resumed = *found->second;
  inactive_.erase(found);
  resumed.motions = MapMotions(options);
  if (keeps_present) keep_present();
  present_ = std::move(resumed);
  return true;
}

void Atlas::join(std::uint32_t older_id, std::uint32_t newer_id, JoinedMaps joined,
                 const MapperOptions& options) {
  const auto find = [this](std::uint32_t id) -> const AtlasMap& {
    return id == present_.id ? present_ : inactive(id);
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
  if (takes_unit) transform(Sim3::scaling(1 / joined.scale), unit_of_newer);
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

bool Atlas::renew_unit(const ScaleOptions& scale, double least_change) {
  const std::optional<double> metres = present_.unit.metres(map().scale_source(), scale, map());
  if (!metres || std::abs(*metres - 1) <= least_change) return false;
  transform(Sim3::scaling(*metres));
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
  const auto at = map().keyframes().find(id);
  const auto in_time = at == map().keyframes().begin() ? std::next(at) : std::prev(at);
  present_.map.remove_keyframe(id, nearest.empty() ? in_time->first : nearest[0]);
  present_.motions.remove(id);
  present_.covariances.erase(id);
  TrackExtender(options, present_.motions.excluded(), &present_.map).cull(seen);
}

void Atlas::remove_keyframes(const std::set<KeyframeId>& ids, const MapperOptions& options) {
  for (const KeyframeId id : ids) {
    if (map().keyframe(id)) remove_keyframe(id, options);
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

Atlas::Checkpoint Atlas::checkpoint() {
  return {present_.map.snapshot(),
          {present_.id, Map(), present_.places, present_.covariances, present_.unit, present_.motions},
          inactive_,
          corrections_,
          last_correction_};
}

void Atlas::go_back(const Checkpoint& checkpoint) {
  AtlasMap present = checkpoint.present;
  present.map = Map::of(checkpoint.map);
  present.places->reset(present.map);
  // The place index of a map that was taken may have followed another one.
  for (const auto& [id, inactive] : checkpoint.inactive) {
    const auto now = inactive_.find(id);
    if (now == inactive_.end() || now->second != inactive) inactive->places->reset(inactive->map);
  }
  present_ = std::move(present);
  inactive_ = checkpoint.inactive;
  corrections_ = checkpoint.corrections;
  last_correction_ = checkpoint.last_correction;
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

namespace {

// The triangulated corners of a marker; none when the cameras do not determine them.
std::vector<Eigen::Vector3d> marker_corners(const std::vector<Rigid3>& cameras_from_map,
                                            const std::vector<std::vector<Eigen::Vector3d>>& markers) {
  if (markers.size() < 2) return {};
  std::vector<Eigen::Vector3d> corners(4);
  for (int c = 0; c < 4; ++c) {
    std::vector<Eigen::Vector3d> bearings;
    bearings.reserve(markers.size());
    for (const auto& marker : markers) bearings.push_back(marker[c]);
    if (!triangulate_multi_view(cameras_from_map, bearings, &corners[c])) return {};
  }
  return corners;
}

double side(const std::vector<Eigen::Vector3d>& corners, int c) {
  return (corners[(c + 1) % 4] - corners[c]).norm();
}

double mean_side(const std::vector<Eigen::Vector3d>& corners) {
  double sum = 0;
  for (int c = 0; c < 4; ++c) sum += side(corners, c);
  return sum / 4;
}

bool is_square(const std::vector<Eigen::Vector3d>& corners, double max_side_difference) {
  const double mean = mean_side(corners);
  for (int c = 0; c < 4; ++c) {
    if (std::abs(side(corners, c) - mean) > max_side_difference * mean) return false;
  }
  return true;
}

// The widest parallax between the first camera and any other.
double widest_parallax(const std::vector<Rigid3>& cameras_from_map, const Eigen::Vector3d& x_in_map) {
  double widest = 0;
  const Eigen::Vector3d first = cameras_from_map.front().inverse().translation;
  for (const Rigid3& camera : cameras_from_map) {
    widest = std::max(widest, parallax_angle(x_in_map, first, camera.inverse().translation));
  }
  return widest;
}

std::optional<double> metres_by_baseline(double known_baseline, const UnitSource& unit, const Map& map) {
  if (!unit.baseline) return std::nullopt;
  Rigid3 first, last;
  if (!map.camera_from_map(unit.baseline->first, &first)) return std::nullopt;
  if (!map.camera_from_map(unit.baseline->second, &last)) return std::nullopt;
  return known_baseline / (last.inverse().translation - first.inverse().translation).norm();
}

std::optional<double> metres_by_marker(double marker_size, const UnitSource& unit, const Map& map) {
  std::vector<Rigid3> cameras_from_map;
  std::vector<std::vector<Eigen::Vector3d>> markers;
  for (const auto& [id, corners] : unit.markers) {
    const Keyframe* keyframe = map.keyframe(id);
    if (!keyframe) continue;  // culled meanwhile
    cameras_from_map.push_back(keyframe->camera_from_map);
    markers.push_back(corners);
  }
  const std::vector<Eigen::Vector3d> corners = marker_corners(cameras_from_map, markers);
  if (corners.empty() || !is_square(corners, kMapperLimits.max_side_difference) ||
      widest_parallax(cameras_from_map, corners[0]) < kMapperLimits.marker_parallax) {
    return std::nullopt;
  }
  return marker_size / mean_side(corners);
}

}  // namespace

std::optional<double> UnitSource::metres(ScaleSource source, const ScaleOptions& scale,
                                         const Map& map) const {
  if (source == ScaleSource::kKnownBaseline) return metres_by_baseline(scale.known_baseline, *this, map);
  if (source == ScaleSource::kMarker) return metres_by_marker(scale.marker_size, *this, map);
  return std::nullopt;
}

ScaleSource UnitSource::begin(const InitialMap& initial, const std::vector<KeyframeId>& ids,
                              const ScaleOptions& scale) {
  if (scale.known_baseline > 0) {
    baseline = {ids.front(), ids.back()};
    return ScaleSource::kKnownBaseline;
  }
  if (scale.marker_size <= 0) return ScaleSource::kMapUnits;
  for (std::size_t v = 0; v < ids.size(); ++v) {
    if (!initial.views[v].frame.marker.empty()) markers[ids[v]] = initial.views[v].frame.marker;
  }
  return ScaleSource::kMarker;
}

void UnitSource::forget(const std::set<KeyframeId>& wrong, const Map& map) {
  const auto is_gone = [&](KeyframeId id) { return wrong.count(id) > 0 && !map.keyframe(id); };
  // In a joined map, either may be another than the map's first.
  if (baseline && (is_gone(baseline->first) || is_gone(baseline->second))) baseline.reset();
  for (const KeyframeId id : wrong) {
    if (is_gone(id)) markers.erase(id);
  }
}

}  // namespace mono_pose_tracker
