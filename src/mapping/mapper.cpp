#include "mapping/mapper.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "common/statistics.h"
#include "keyframe_landmarks.h"
#include "mapping/depth_reversal.h"
#include "mapping/mapper_limits.h"
#include "mapping/planar_ambiguity.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

// Corrects a depth reversal (an object viewed from far away) or the second planar solution (a wall viewed
// from near) of a young map. Returns whether the map was replaced.
bool was_corrected(const MapperOptions& options, Map* map) {
  if (is_narrow(*map))
    return correct_depth_reversal(options.window_bundle(), kMapperLimits.min_correction, map);
  return correct_geometry(options.window_bundle(), options.ransac, kMapperLimits.min_correction, map);
}

// When the beginning is tested. A keyframe comes every two or three degrees of rotation: so every fifteen
// degrees or so, up to sixty, where a reversal fits plainly worse. Each test takes several adjustments.
bool is_due(std::size_t keyframes) { return keyframes % 6 == 0 && keyframes <= 24; }

// Share of the keyframe's landmarks for which it is redundant: at least redundant_observers others observe
// them. 1 when it observes none.
double redundant_share(const Map& map, const Keyframe& keyframe) {
  const std::vector<LandmarkId> seen = landmarks_of(keyframe);
  const auto redundant = std::count_if(seen.begin(), seen.end(), [&](LandmarkId l) {
    return map.landmark(l)->observations.size() > static_cast<std::size_t>(kMapperLimits.redundant_observers);
  });
  return seen.empty() ? 1 : static_cast<double>(redundant) / static_cast<double>(seen.size());
}

// The earliest of equals.
KeyframeId most_redundant(const std::map<KeyframeId, double>& shares) {
  return std::max_element(shares.begin(), shares.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

void Mapper::initialize(const InitialMap& initial, std::uint32_t epoch) {
  atlas_.clear();
  view_graph_.reset();
  begin(initial, epoch);
}

void Mapper::begin_additional(const InitialMap& initial, std::uint32_t epoch) {
  atlas_.keep_present();
  atlas_.cap_inactive(static_cast<std::size_t>(options_.mapping.max_keyframes));
  begin(initial, epoch);
}

// The state of one map does not apply to another.
void Mapper::reset_state() {
  state_ = State(options_);
  background_ = {false, false, background_.ticket + 1, nullptr};
}

void Mapper::begin(const InitialMap& initial, std::uint32_t epoch) {
  reset_state();
  epoch_ = epoch;
  auto& [id, map, places, covariances, unit, motions] = atlas_.begin(epoch + 1, options_);
  std::vector<KeyframeId> ids;
  for (const InitialMap::View& view : initial.views) {
    ids.push_back(
        map.add_keyframe(view.frame.index, view.frame.stamp_ns, view.camera_from_map, view.frame.image));
    motions.add(ids.back(), view.frame);
  }
  motions.begin(options_, initial);
  std::vector<double> distances;
  for (const InitialMap::Point& point : initial.points) {
    const LandmarkId l = map.add_landmark(point.x_in_map);
    for (const auto& [view, feature] : point.observations) map.add_observation(l, ids[view], feature);
    distances.push_back((initial.views[0].camera_from_map * point.x_in_map).norm());
  }
  const double wanted = options_.scale.initial_median_depth;
  map.rescale((wanted > 0 ? wanted : 1) / median(distances));
  if (wanted > 0) map.set_scale_source(ScaleSource::kInitialMedianDepth);
  {
    const StageTimer timer(stages_, "map_match");
    for (const KeyframeId k : ids) motions.separate(options_, kMapperLimits.motion_partners, k, &map);
    for (std::size_t v = 0; v < ids.size(); ++v) {
      if (!initial.views[v].fixed.empty()) motions.exclude(ids[v], initial.views[v].fixed, &map);
      motions.exclude_static_overlay(options_, ids[v], &map);
    }
    for (const KeyframeId k : ids)
      extender().create_landmarks(k, neighbors(map, k, options_.mapping.matching_keyframes));
  }
  adjust_window(ids.back(), 0);
  const ScaleSource source = unit.begin(initial, ids, options_.scale);
  if (const auto metres = unit.metres(source, options_.scale, map)) {
    map.rescale(*metres);
    scale_covariances([&, factor = *metres](KeyframeId) { return factor; }, &covariances);
    map.set_scale_source(source);
  }
  publish();
}

void Mapper::restore(Map map, std::uint32_t epoch) {
  atlas_.clear();
  view_graph_.reset();
  restore_additional(std::move(map), epoch);
}

void Mapper::restore_additional(Map map, std::uint32_t epoch) {
  atlas_.keep_present();
  reset_state();
  epoch_ = epoch;
  AtlasMap& restored = atlas_.begin(epoch + 1, options_);
  restored.map = std::move(map);
  restored.covariances = find_covariances(options_, restored.map);
  publish();
}

bool Mapper::resume(std::uint32_t map_id, bool keep_present, std::uint32_t epoch) {
  epoch_ = epoch;
  const bool is_present = map_id == present().id && !map().keyframes().empty();
  const bool has_switched = !is_present && atlas_.resume(map_id, keep_present, options_);
  if (has_switched) {
    reset_state();
    state_.merged_up_to = map().keyframes().rbegin()->first;  // up to the last adjustment, approximately
  } else {
    drop_background_job();  // it belongs to another epoch
  }
  publish();
  return is_present || has_switched;
}

void Mapper::insert(const KeyframeCandidate& candidate_as_sent, int waiting) {
  KeyframeCandidate candidate = candidate_as_sent;
  AtlasMap& present = this->present();
  Map& map = present.map;
  Rigid3 reference_from_map;
  if (!atlas_.bring_up_to_date(&candidate) || candidate.map_id != present.id ||
      !map.camera_from_map(candidate.reference, &reference_from_map))
    return;
  atlas_.forget_old_corrections(kMapperLimits.kept_corrections);
  const Frame& frame = candidate.frame;
  const KeyframeId id = map.add_keyframe(frame.index, frame.stamp_ns,
                                         candidate.camera_from_reference * reference_from_map, frame.image);
  present.motions.add(id, frame);
  for (const FrameObservation& o : candidate.observations) map.add_observation(o.landmark, id, o.feature);
  match(id);
  adjust_window(id, waiting);
  correct_beginning();
  cull_young_landmarks(id);
  cull_keyframes(id);
  cap_keyframes(id);
  scale_by_marker(id, frame.marker);
  present.motions.watch_background(options_, frame, map, &stages_);
  if (waiting == 0) present.motions.watch_object(options_, map);
  if (waiting == 0 && !is_cancelled()) join_where_aligned(map.keyframes().rbegin()->first);
  publish();
}

// Guided matching in both directions.
void Mapper::match(KeyframeId id) {
  const StageTimer timer(stages_, "map_match");
  Map& map = present().map;
  present().motions.separate(options_, kMapperLimits.motion_partners, id, &map);
  present().motions.exclude_static_overlay(options_, id, &map);
  const std::vector<KeyframeId> near = neighbors(map, id, options_.mapping.matching_keyframes);
  SimilarKeyframes unknown;
  extender().extend(id, extender().within_reach(id, kMapperLimits.large_map, *present().places, &unknown));
  extender().create_landmarks(id, near);
  for (const KeyframeId n : near) {
    if (is_cancelled()) break;
    extender().extend(n, landmarks_of(*map.keyframe(id)));
  }
}

void Mapper::adjust_window(KeyframeId newest, int waiting) {
  const StageTimer timer(stages_, "map_adjust");
  // A map of up to two windows is adjusted completely: its first points come from the least parallax, and
  // their errors must be corrected.
  const int size = options_.mapping.window_keyframes / (1 + waiting);
  std::vector<KeyframeId> window;
  if (waiting == 0 && static_cast<int>(map().keyframes().size()) <= 2 * size) {
    for (const auto& entry : map().keyframes()) window.push_back(entry.first);
  } else {
    window = neighbors(map(), newest, size - 1);
    window.push_back(newest);
  }
  if (waiting < 2) adjust(window, held_keyframes(size));
  extender().cull(landmarks_observed_by(map(), window));
  if (waiting == 0) update_covariances(options_, map(), window, &present().covariances);
}

void Mapper::adjust(const std::vector<KeyframeId>& window, int fixed) {
  failed_adjustments_ += adjust_keyframes(options_.window_bundle(), window, fixed,
                                          options_.mapping.window_landmarks, &present().map)
                             .failed;
}

// Tested several times while the map is young, as the evidence grows with the rotation, and once at each
// size. Culling may bring a map to the same size more than once.
void Mapper::correct_beginning() {
  const std::size_t keyframes = map().keyframes().size();
  if (keyframes <= state_.asked_at || !is_due(keyframes) || is_cancelled()) return;
  state_.asked_at = keyframes;
  if (was_corrected(options_, &present().map)) {
    drop_background_job();  // it works on the map before the change
    present().covariances = find_covariances(options_, map());
    atlas_.add_other_geometry();
  }
  renew_unit();
}

void Mapper::cull_young_landmarks(KeyframeId newest) {
  for (const LandmarkId l : map().landmarks_created_by(newest - kMapperLimits.keyframes_to_confirm)) {
    if (map().landmark(l)->observations.size() == 2) present().map.remove_landmark(l);
  }
}

// Removes keyframes that are redundant for most of their landmarks.
void Mapper::cull_keyframes(KeyframeId newest) {
  for (const KeyframeId id : neighbors(map(), newest, options_.mapping.window_keyframes)) {
    if (map().keyframes().size() <= kMapperLimits.fewest_keyframes || id == map().keyframes().begin()->first)
      continue;
    const double share = redundant_share(map(), *map().keyframe(id));
    if (share >= options_.mapping.redundant_overlap && !neighbors(map(), id, 1).empty())
      atlas_.remove_keyframe(id, options_);
  }
}

// Above the limit, removes the most redundant keyframes, but never the first two, which define the map's
// frame, nor those near the camera.
void Mapper::cap_keyframes(KeyframeId newest) {
  const auto most = static_cast<std::size_t>(options_.mapping.max_keyframes);
  if (most == 0) return;
  // Frames of the last minutes are stored relative to these.
  present().map.forget_removed_keyframes(kMapperLimits.removed_keyframes);
  if (map().keyframes().size() <= most) return;
  std::set<KeyframeId> spared = {newest};
  // At most half of the cap: a map smaller than two windows must lose some of its window.
  const int window = std::min(options_.mapping.window_keyframes, static_cast<int>(most / 2));
  for (const KeyframeId id : neighbors(map(), newest, window)) spared.insert(id);
  auto first = map().keyframes().begin();
  for (int i = 0; i < 2; ++i) spared.insert((first++)->first);
  std::map<KeyframeId, double> shares;
  for (const auto& [id, keyframe] : map().keyframes()) {
    if (!spared.count(id)) shares[id] = redundant_share(map(), keyframe);
  }
  const std::size_t kept = most - most / kMapperLimits.room_made_at_once;
  while (map().keyframes().size() > kept && !shares.empty()) {
    const KeyframeId least_useful = most_redundant(shares);
    const auto affected = map().covisible(least_useful);
    atlas_.remove_keyframe(least_useful, options_);
    shares.erase(least_useful);
    for (const auto& entry : affected) {
      const auto share = shares.find(entry.first);
      if (share != shares.end()) share->second = redundant_share(map(), *map().keyframe(entry.first));
    }
  }
}

bool Mapper::renew_unit() {
  if (!atlas_.renew_unit(options_.scale, kMapperLimits.reported_unit_change)) return false;
  drop_background_job();
  return true;
}

// Sets the scale by a marker that could not be used at the beginning.
void Mapper::scale_by_marker(KeyframeId newest, const std::vector<Eigen::Vector3d>& marker) {
  if (options_.scale.marker_size <= 0 || map().scale_source() != ScaleSource::kMapUnits || marker.empty())
    return;
  present().unit.markers[newest] = marker;
  if (const auto metres = present().unit.metres(ScaleSource::kMarker, options_.scale, map()))
    transform(Sim3::scaling(*metres), ScaleSource::kMarker);
}

void Mapper::transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  if (map().keyframes().empty()) return;
  drop_background_job();
  atlas_.transform(new_from_map, scale_source);
  publish();
}

ViewGraph& Mapper::view_graph() {
  if (!view_graph_) view_graph_.emplace(view_graph_options(options_));
  return *view_graph_;
}

void Mapper::finish() {
  if (map().keyframes().empty()) return;
  const std::uint64_t before = atlas_.last_correction();
  GlobalRefiner refiner(options_, &atlas_, &view_graph());
  refiner.finish();
  take_over(refiner, before);
}

std::set<KeyframeId> Mapper::refine_with_graph() {
  const std::uint64_t before = atlas_.last_correction();
  GlobalRefiner refiner(options_, &atlas_, &view_graph());
  const std::set<KeyframeId> removed = refiner.refine();
  take_over(refiner, before);
  return removed;
}

std::set<KeyframeId> Mapper::remove_wrong(const std::set<KeyframeId>& wrong) {
  const std::uint64_t before = atlas_.last_correction();
  GlobalRefiner refiner(options_, &atlas_, &view_graph());
  const std::set<KeyframeId> removed = refiner.remove(wrong);
  take_over(refiner, before);
  return removed;
}

void Mapper::take_over(const GlobalRefiner& refiner, std::uint64_t corrections_before) {
  failed_adjustments_ += refiner.failed_adjustments();
  if (atlas_.last_correction() != corrections_before) drop_background_job();
  publish();
}

void Mapper::publish() {
  auto view = std::make_shared<TrackingMap>();
  AtlasMap& present = this->present();
  view->epoch = epoch_;
  view->map_id = present.id;
  view->corrections = atlas_.corrections();
  view->inactive_maps = inactive_maps();
  view->turning_object = present.motions.watch().object();
  view->doubt = present.motions.watch().doubt();
  present.places->follow(present.map);
  view->places = present.places;
  view->scale_source = present.map.scale_source();
  view->revision = ++revision_;
  view->keyframes = present.map.views().keyframes();
  view->landmarks = present.map.views().landmarks();
  view->covariances = present.covariances;
  view->removed_keyframes = present.map.removed_keyframes();
  view->stages = std::exchange(stages_, {});
  tracking_map_ = std::move(view);
}

Mapper::Checkpoint Mapper::checkpoint() {
  return {atlas_.checkpoint(), state_, epoch_, loops_.size(), tracking_map_};
}

// Background work that began before the change goes on: its completion belongs to the same map.
void Mapper::go_back(const Checkpoint& checkpoint) {
  atlas_.go_back(checkpoint.atlas);
  if (background_.job) background_ = {false, false, background_.ticket + 1, nullptr};
  state_ = checkpoint.state;
  epoch_ = checkpoint.epoch;
  loops_.resize(checkpoint.loops);
  tracking_map_ = checkpoint.tracking_map;
  stages_.clear();
}

// Joining maps.

std::optional<MapAlignment> Mapper::find_alignment(const AtlasMap& other, KeyframeId keyframe) const {
  std::vector<KeyframeId> keyframes = neighbors(map(), keyframe, kMapperLimits.other_views);
  keyframes.insert(keyframes.begin(), keyframe);
  for (const KeyframeId place : other.places->find(map().keyframe(keyframe)->image->set, kBestPlaces)) {
    if (auto alignment = align_maps(options_, map(), keyframes, other.map, place)) return alignment;
  }
  return std::nullopt;
}

// The present map may be the older one (switched to, or loaded): its frame stays.
bool Mapper::join_where_aligned(KeyframeId newest) {
  const std::uint32_t own = present().id;
  for (const std::uint32_t id : inactive_maps()) {
    const std::optional<MapAlignment> alignment = find_alignment(atlas_.inactive(id), newest);
    if (!alignment) continue;
    if (id < own && join(id, own, *alignment)) return true;
    if (id > own && !alignment->found_in_other.empty() && join(own, id, alignment->inverse())) return true;
  }
  return false;
}

// Changes nothing where the joined map does not hold. One of the two maps is the present one.
bool Mapper::join(std::uint32_t older_id, std::uint32_t newer_id, const MapAlignment& newer_in_older) {
  const auto map_of = [&](std::uint32_t id) -> const Map& {
    return id == present().id ? map() : atlas_.inactive(id).map;
  };
  JoinedMaps joined = join_maps(options_, map_of(older_id), map_of(newer_id), newer_in_older);
  failed_adjustments_ += joined.failed_adjustments;
  if (!joined.holds) return false;
  atlas_.join(older_id, newer_id, std::move(joined), options_);
  reset_state();
  return true;
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
  ids.push_back(present().id);
  std::sort(ids.begin(), ids.end());
  for (std::size_t newer = ids.size() - 1; newer > 0; --newer) {
    resume(ids[newer], true, epoch_);
    for (std::size_t older = 0; older < newer; ++older) {
      if (apart->count({ids[newer], ids[older]})) continue;
      const AtlasMap& other = atlas_.inactive(ids[older]);
      const std::optional<MapAlignment> alignment =
          align_maps(options_, map(), other.map, *other.places, &view_graph());
      if (!alignment || !join(ids[older], ids[newer], *alignment)) {
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

}  // namespace mono_pose_tracker
