#include "mapping/mapper.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "common/rotation.h"
#include "common/statistics.h"
#include "cross_view_matcher.h"
#include "epipolar_matcher.h"
#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "known_baseline.h"
#include "mapping/depth_reversal.h"
#include "mapping/in_view.h"
#include "mapping/planar_ambiguity.h"
#include "mapping/projection_matcher.h"
#include "optimization/map_adjustment.h"
#include "unobserved_landmarks.h"

namespace mono_pose_tracker {

namespace {

// Corrects a depth reversal (an object viewed from far away) or the second planar solution (a wall viewed
// from near) of a young map. Returns whether the map was replaced.
bool was_corrected(const MapperOptions& options, const MapperLimits& limits, Map* map) {
  if (is_narrow(*map, limits.alternatives))
    return correct_depth_reversal(options.window_bundle(), limits.min_correction, map, limits.alternatives);
  return correct_geometry(options.window_bundle(), options.ransac, limits.min_correction, map,
                          limits.alternatives);
}

// When the beginning is tested. A keyframe comes every two or three degrees of rotation: so every fifteen
// degrees or so, up to sixty, where a reversal fits plainly worse. Each test takes several adjustments.
bool is_due(std::size_t keyframes) { return keyframes % 6 == 0 && keyframes <= 24; }

}  // namespace

std::vector<KeyframeId> Mapper::neighbors(KeyframeId id, int count) const {
  std::vector<KeyframeId> result;
  for (const auto& [other, shared] : map_.covisible(id)) {
    if (static_cast<int>(result.size()) < count) result.push_back(other);
  }
  return result;
}

void Mapper::initialize(const InitialMap& initial, std::uint32_t epoch) {
  inactive_.clear();
  view_graph_.reset();
  begin(initial, epoch);
}

void Mapper::begin_additional(const InitialMap& initial, std::uint32_t epoch) {
  keep_present();
  cap_inactive_maps();
  begin(initial, epoch);
}

// The state of one map does not apply to another.
void Mapper::reset_map_state() {
  const std::uint64_t ticket = map_state_.ticket + 1;
  map_state_ = MapState(options_, camera_, limits_.loops);
  map_state_.ticket = ticket;
  covariances_ = KeyframeCovariances();
}

void Mapper::begin(const InitialMap& initial, std::uint32_t epoch) {
  map_ = Map();
  places_ = std::make_shared<KeyframePlaces>();
  reset_map_state();
  unit_ = {};
  epoch_ = epoch;
  map_id_ = epoch + 1;
  std::vector<KeyframeId> ids;
  for (const InitialMap::View& view : initial.views) {
    ids.push_back(
        map_.add_keyframe(view.frame.index, view.frame.stamp_ns, view.camera_from_map, view.frame.image));
    if (view.frame.unmasked) map_state_.unmasked[ids.back()] = view.frame.unmasked;
  }
  watch_static_background(initial);
  std::vector<double> distances;
  for (const InitialMap::Point& point : initial.points) {
    const LandmarkId l = map_.add_landmark(point.x_in_map);
    for (const auto& [view, feature] : point.observations) map_.add_observation(l, ids[view], feature);
    distances.push_back((initial.views[0].camera_from_map * point.x_in_map).norm());
  }
  const double wanted = options_.scale.initial_median_depth;
  map_.rescale((wanted > 0 ? wanted : 1) / median(distances));
  if (wanted > 0) map_.set_scale_source(ScaleSource::kInitialMedianDepth);
  {
    const StageTimer timer(stages_, "map_match");
    for (const KeyframeId id : ids) separate_motions(id);
    for (std::size_t v = 0; v < ids.size(); ++v) {
      if (!initial.views[v].fixed.empty()) exclude(ids[v], initial.views[v].fixed);
      exclude_static_overlay(ids[v]);
    }
    for (const KeyframeId id : ids) {
      const std::vector<KeyframeId> near = neighbors(id, options_.mapping.matching_keyframes);
      create_landmarks(id, near);
    }
  }
  adjust_window(ids.back(), 0);
  set_scale(initial, ids);
  publish();
}

void Mapper::restore(Map map, std::uint32_t epoch) {
  inactive_.clear();
  view_graph_.reset();
  map_ = Map();
  restore_additional(std::move(map), epoch);
}

void Mapper::restore_additional(Map map, std::uint32_t epoch) {
  keep_present();
  map_ = std::move(map);
  places_ = std::make_shared<KeyframePlaces>();
  reset_map_state();
  unit_ = {};
  find_covariances();
  epoch_ = epoch;
  map_id_ = epoch + 1;
  publish();
}

void Mapper::insert(const KeyframeCandidate& candidate_as_sent, int waiting) {
  KeyframeCandidate candidate = candidate_as_sent;
  Rigid3 reference_from_map;
  if (!bring_up_to_date(&candidate) || candidate.map_id != map_id_ ||
      !map_.camera_from_map(candidate.reference, &reference_from_map))
    return;
  forget_old_corrections();
  const KeyframeId id =
      map_.add_keyframe(candidate.frame.index, candidate.frame.stamp_ns,
                        candidate.camera_from_reference * reference_from_map, candidate.frame.image);
  if (candidate.frame.unmasked) map_state_.unmasked[id] = candidate.frame.unmasked;
  for (const FrameObservation& o : candidate.observations) map_.add_observation(o.landmark, id, o.feature);
  match(id);
  adjust_window(id, waiting);
  correct_beginning();
  cull_young_landmarks(id);
  cull_keyframes(id);
  cap_keyframes(id);
  scale_by_marker(id, candidate.frame.marker);
  watch_static_background(candidate);
  if (waiting == 0) watch_map_object();
  if (waiting == 0 && !is_cancelled()) join_where_aligned(map_.keyframes().rbegin()->first);
  publish();
}

// Guided matching in both directions.
void Mapper::match(KeyframeId id) {
  const StageTimer timer(stages_, "map_match");
  separate_motions(id);
  exclude_static_overlay(id);
  const std::vector<KeyframeId> near = neighbors(id, options_.mapping.matching_keyframes);
  SimilarKeyframes unknown;
  fuse(id, within_reach(id, &unknown));
  create_landmarks(id, near);
  for (const KeyframeId n : near) {
    if (is_cancelled()) break;
    fuse(n, landmarks_of(*map_.keyframe(id)));
  }
}

// Tested several times while the map is young, as the evidence grows with the rotation, and once at each
// size. Culling may bring a map to the same size more than once.
void Mapper::correct_beginning() {
  const std::size_t keyframes = map_.keyframes().size();
  if (keyframes <= map_state_.asked_at || !is_due(keyframes) || is_cancelled()) return;
  map_state_.asked_at = keyframes;
  if (was_corrected(options_, limits_, &map_)) report_corrected_beginning();
  renew_scale(limits_.reported_unit_change);
}

void Mapper::report_corrected_beginning() {
  drop_background_job();  // it works on the map before the change
  find_covariances();
  MapCorrection correction;
  correction.of_map = correction.into_map = map_id_;
  correction.other_geometry = true;
  add_correction(std::move(correction));
}

// Landmarks that may be in view of a keyframe; nothing: all. In a large map: landmarks of keyframes connected
// to it directly or by one between, and of similar keyframes.
std::optional<std::vector<LandmarkId>> Mapper::within_reach(KeyframeId id, SimilarKeyframes* known) const {
  const std::size_t keyframes = map_.keyframes().size();
  if (keyframes <= limits_.large_map) return std::nullopt;
  const std::vector<KeyframeId> direct = neighbors(id, std::numeric_limits<int>::max());
  if (2 * direct.size() > keyframes) return std::nullopt;
  std::set<KeyframeId> near = {id};
  const auto add_with_neighbors = [&](KeyframeId other) {
    if (!map_.keyframe(other)) return;
    near.insert(other);
    for (const KeyframeId next : neighbors(other, options_.mapping.window_keyframes)) near.insert(next);
  };
  for (const KeyframeId other : direct) add_with_neighbors(other);
  const auto [places, is_new] = known->emplace(id, std::vector<KeyframeId>());
  if (is_new) places->second = places_->find(map_.keyframe(id)->image->set, kBestPlaces);
  for (const KeyframeId place : places->second) add_with_neighbors(place);
  return landmarks_observed_by(map_, {near.begin(), near.end()});
}

// Extends tracks: projects landmarks that the target keyframe does not observe into it. A landmark that
// matches a feature gains an observation. Where the feature already observes another landmark, the two are
// merged if both agree with all of their observations.
void Mapper::fuse(KeyframeId target, const std::optional<std::vector<LandmarkId>>& landmarks) {
  const Keyframe& keyframe = *map_.keyframe(target);
  const CameraModel& camera = keyframe.image->camera;
  ProjectionMatchOptions guided;
  guided.radius_px = options_.mapping.max_reprojection_px;
  const std::vector<LandmarkCandidate> candidates =
      unobserved_in_view(map_, keyframe, landmarks, guided.radius_px);
  guided.max_distance2 = stored_distance2(options_.mapping.max_descriptor_distance);
  guided.cancelled = options_.ransac.cancelled;
  for (const LandmarkMatch& m :
       match_by_projection(candidates, *keyframe.image, camera, keyframe.camera_from_map, guided)) {
    if (is_excluded(target, m.feature)) continue;
    const LandmarkId l = candidates[m.candidate].id;
    const LandmarkId held = keyframe.landmark_of_feature[m.feature];
    if (held == kNoLandmark) {
      map_.add_observation(l, target, m.feature);
    } else if (held != l) {
      const Landmark& a = *map_.landmark(l);
      const Landmark& b = *map_.landmark(held);
      const auto agrees = [&](const Observation& o) {
        return error_px(*map_.keyframe(o.keyframe), o.feature, b.x_in_map) <
               options_.mapping.max_reprojection_px;
      };
      if (std::all_of(a.observations.begin(), a.observations.end(), agrees)) map_.merge_landmarks(l, held);
    }
  }
}

// Triangulates new landmarks from features matched along epipolar lines.
void Mapper::create_landmarks(KeyframeId newest, const std::vector<KeyframeId>& near) {
  EpipolarMatchOptions guided;
  guided.threads = options_.bundle.own_threads;
  guided.max_distance2 = stored_distance2(options_.mapping.max_descriptor_distance);
  guided.cancelled = options_.ransac.cancelled;
  guided.min_ratio = options_.matching.min_ratio;
  for (const KeyframeId n : near) {
    if (is_cancelled()) return;
    const Keyframe& first = *map_.keyframe(newest);
    const Keyframe& second = *map_.keyframe(n);
    if (!is_baseline_known(map_, first, second)) continue;
    guided.max_error_rad = options_.mapping.max_reprojection_px /
                           std::min(first.image->camera.focal(), second.image->camera.focal());
    const Rigid3 second_from_first = second.camera_from_map * first.camera_from_map.inverse();
    const Rigid3 map_from_first = first.camera_from_map.inverse();
    for (const Match& m : match_along_epipolar_lines(first, second, guided)) {
      if (is_excluded(newest, m.first) || is_excluded(n, m.second)) continue;
      Eigen::Vector3d x_in_first;
      if (!triangulate_two_views(second_from_first, first.image->set.bearings[m.first],
                                 second.image->set.bearings[m.second], &x_in_first)) {
        continue;
      }
      const Eigen::Vector3d x_in_map = map_from_first * x_in_first;
      if (parallax_angle(x_in_map, first.center_in_map(), second.center_in_map()) <
              options_.mapping.min_parallax_deg * kDegree ||
          error_px(first, m.first, x_in_map) > options_.mapping.max_reprojection_px ||
          error_px(second, m.second, x_in_map) > options_.mapping.max_reprojection_px) {
        continue;
      }
      const LandmarkId l = map_.add_landmark(x_in_map);
      map_.add_observation(l, newest, m.first);
      map_.add_observation(l, n, m.second);
    }
  }
}

void Mapper::adjust_window(KeyframeId newest, int waiting) {
  const StageTimer timer(stages_, "map_adjust");
  // A map of up to two windows is adjusted completely: its first points come from the least parallax, and
  // their errors must be corrected.
  const int size = options_.mapping.window_keyframes / (1 + waiting);
  std::vector<KeyframeId> window;
  if (waiting == 0 && static_cast<int>(map_.keyframes().size()) <= 2 * size) {
    for (const auto& entry : map_.keyframes()) window.push_back(entry.first);
  } else {
    window = neighbors(newest, size - 1);
    window.push_back(newest);
  }
  if (waiting < 2) {
    count(adjust_keyframes(options_.window_bundle(), window, held_keyframes(size),
                           options_.mapping.window_landmarks, &map_));
  }
  cull_observations(landmarks_observed_by(map_, window));
  if (waiting == 0) update_covariances(window);
}

// Extends all tracks and creates landmarks between covisible keyframes.
void Mapper::complete(SimilarKeyframes* similar) {
  for (const auto& entry : map_.keyframes()) {
    const KeyframeId id = entry.first;
    const std::vector<KeyframeId> near = neighbors(id, 2 * options_.mapping.matching_keyframes);
    fuse(id, within_reach(id, similar));
    create_landmarks(id, near);
  }
}

// Adjusts the whole map, its poses by some of the landmarks.
void Mapper::adjust_roughly(const BundleOptions& bundle) {
  std::vector<KeyframeId> all;
  for (const auto& entry : map_.keyframes()) all.push_back(entry.first);
  count(adjust_keyframes(bundle, all, 0, limits_.rough_landmarks, &map_));
}

// Adjusts with a wide loss first, so that merged tracks have an effect before anything is culled.
void Mapper::adjust_after_merging() {
  const BundleOptions bundle = final_bundle();
  for (const BundleOptions& pass : {with_wide_loss(bundle), bundle}) adjust_roughly(pass);
}

BundleOptions Mapper::final_bundle() const {
  BundleOptions bundle = options_.bundle;
  bundle.max_iterations = limits_.final_iterations;
  return bundle;
}

void Mapper::finish() {
  if (map_.keyframes().empty()) return;
  exclude_static_overlay();
  // All shared tracks are kept, unlike in a growing map, and inconsistent ones are culled below. Dropping
  // them cost a recording with many gaps a tenth of its images.
  const KeyframePairs overlapping = overlapping_pairs(options_.bundle, map_, -1, limits_.cross_view);
  connect(overlapping);
  if (!match_across_views(options_, overlapping, &view_graph(), &map_).empty()) adjust_after_merging();
  retriangulate({});
  // Twice: better poses give more matches, and outliers found by the first adjustment must not bias the
  // second.
  SimilarKeyframes similar;
  complete(&similar);
  BundleOptions rough = final_bundle();
  rough.function_tolerance = limits_.rough_tolerance;
  adjust_roughly(rough);
  cull_observations(map_.landmark_ids());
  complete(&similar);
  settle();
}

// Adjusts the whole map to convergence.
void Mapper::settle() {
  BundleOptions bundle = final_bundle();
  bundle.function_tolerance = limits_.final_tolerance;
  count(adjust_map(bundle, &map_));
  cull_observations(map_.landmark_ids());
  drop_two_view_landmarks();
  renew_scale(0);
  publish();
}

// Two views cannot be inconsistent along the epipolar line: landmarks without a third view are dropped from
// the result, unless the map has hardly more views.
void Mapper::drop_two_view_landmarks() {
  if (map_.keyframes().size() <= 3) return;
  for (const LandmarkId l : map_.landmark_ids()) {
    if (map_.landmark(l)->observations.size() == 2) map_.remove_landmark(l);
  }
}

void Mapper::publish() {
  auto view = std::make_shared<TrackingMap>();
  view->epoch = epoch_;
  view->map_id = map_id_;
  view->corrections = corrections_;
  view->inactive_maps = inactive_maps();
  report_doubt(view.get());
  places_->follow(map_);
  view->places = places_;
  view->scale_source = map_.scale_source();
  view->revision = ++revision_;
  view->keyframes = map_.views().keyframes();
  view->landmarks = map_.views().landmarks();
  view->covariances = covariances_;
  view->removed_keyframes = map_.removed_keyframes();
  view->stages = std::exchange(stages_, {});
  tracking_map_ = std::move(view);
}

}  // namespace mono_pose_tracker
