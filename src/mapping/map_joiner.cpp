#include "mapping/map_joiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>

#include "common/statistics.h"
#include "keyframe_landmarks.h"
#include "mapping/known_baseline.h"
#include "mapping/landmark_pose.h"
#include "mapping/track_extender.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

constexpr MapJoinerOptions kJoiner{};

constexpr double kLeastParallax = 1e-6;  // rad: without parallax there is no depth

// The parallax at which a depth is known, in rad.
double known_depth_parallax(const Keyframe& keyframe) {
  return kJoiner.known_depth_px * image_scale(keyframe.image->camera) / keyframe.image->camera.focal();
}

// The observations of a landmark by the first and the last keyframe, which constrain its depth most.
// depth_sigma: of two observations with 0.6 px noise.
std::array<ObservedPoint, 2> observations_of(const Map& map, LandmarkId id) {
  const Landmark& landmark = *map.landmark(id);
  const double parallax = std::max(widest_parallax(map, landmark), kLeastParallax);
  const auto as_seen = [&](const Observation& seen) {
    const Keyframe& keyframe = *map.keyframe(seen.keyframe);
    ObservedPoint observation = observed_point(keyframe, seen.feature, landmark.x_in_map);
    observation.depth_sigma = kJoiner.known_depth_sigma * known_depth_parallax(keyframe) / parallax;
    return observation;
  };
  return {as_seen(landmark.observations.front()), as_seen(landmark.observations.back())};
}

std::vector<SimilarityMatch> paired_observations(const Map& map, const Map& other,
                                                 const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  std::vector<SimilarityMatch> point_pairs;
  for (const auto& [own, theirs] : same) {
    const std::array<ObservedPoint, 2> in_map = observations_of(map, own),
                                       in_other = observations_of(other, theirs);
    for (std::size_t k = 0; k < in_map.size(); ++k) point_pairs.push_back({in_map[k], in_other[k]});
  }
  return point_pairs;
}

// The similarity by which cameras of both maps observe landmarks of the other; by the common landmarks, where
// they are enough, as rays alone leave two orientations of a small planar patch.
std::optional<Sim3> similarity_of_rays(const MapperOptions& options, const Map& map, const Map& other,
                                       const std::vector<RayToPoint>& rays,
                                       const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  SimilarityOptions similarity;
  similarity.ransac = options.ransac;
  const SimilarityReport found = estimate_similarity_from_rays(rays, similarity);
  // A common landmark has at least one ray in either direction.
  if (!found.success || found.num_inliers < 2 * options.min_inliers) return std::nullopt;
  // Each common point has two observations.
  return resolve_flip(paired_observations(map, other, same), similarity, found.b_from_a,
                      2 * options.min_inliers);
}

// Keyframe pairs of the two maps that may show the same place: nearest in time, and similar ones.
std::vector<std::pair<KeyframeId, KeyframeId>> pairs_to_compare(const Map& map, const Map& other,
                                                                const PlaceFinder& places) {
  const std::size_t step = 1 + map.keyframes().size() / kJoiner.asked_keyframes;
  std::size_t number = 0;
  std::vector<std::tuple<std::int64_t, KeyframeId, KeyframeId>> by_time;
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const auto& [other_id, other_keyframe] : other.keyframes())
      by_time.emplace_back(std::abs(keyframe.frame_index - other_keyframe.frame_index), id, other_id);
    if (number++ % step != 0) continue;
    for (const KeyframeId place : places.find(keyframe.image->set, kJoiner.similar_places)) {
      if (other.keyframe(place)) pairs.emplace(id, place);
    }
  }
  const auto end =
      by_time.begin() + static_cast<std::ptrdiff_t>(std::min(kJoiner.nearest_pairs, by_time.size()));
  std::partial_sort(by_time.begin(), end, by_time.end());
  for (auto nearest = by_time.begin(); nearest != end; ++nearest)
    pairs.emplace(std::get<1>(*nearest), std::get<2>(*nearest));
  return {pairs.begin(), pairs.end()};
}

// Rays of the cameras of either map to landmarks of the other.
std::vector<RayToPoint> rays_of(const Map& map, const Map& other, const FoundLandmarks& found,
                                const FoundLandmarks& found_in_other) {
  std::vector<RayToPoint> rays;
  for (const auto& [id, matches] : found) {
    for (const auto& [feature, landmark] : matches)
      rays.push_back(ray_to_point(*map.keyframe(id), feature, other.landmark(landmark)->x_in_map, true));
  }
  for (const auto& [id, matches] : found_in_other) {
    for (const auto& [feature, landmark] : matches)
      rays.push_back(ray_to_point(*other.keyframe(id), feature, map.landmark(landmark)->x_in_map, false));
  }
  return rays;
}

// The found landmarks within a few pixels of where the similarity puts them, of keyframes with enough of
// them.
FoundLandmarks agreeing(const MapperOptions& options, const Map& map, const Map& other,
                        const FoundLandmarks& found, const Sim3& map_from_other) {
  FoundLandmarks agreeing;
  for (const auto& [id, matches] : found) {
    const Keyframe& keyframe = *map.keyframe(id);
    const double limit = kJoiner.max_disagreement_px * image_scale(keyframe.image->camera);
    std::map<int, LandmarkId> near;
    for (const auto& [feature, landmark] : matches) {
      const Eigen::Vector3d x_in_camera =
          keyframe.camera_from_map * (map_from_other * other.landmark(landmark)->x_in_map);
      if (reprojection_error(*keyframe.image, feature, x_in_camera).norm() < limit)
        near.emplace(feature, landmark);
    }
    if (static_cast<int>(near.size()) >= options.min_inliers) agreeing.emplace(id, std::move(near));
  }
  return agreeing;
}

std::optional<MapAlignment> align(const MapperOptions& options, const Map& map, const Map& other,
                                  const FoundLandmarks& found, const FoundLandmarks& found_in_other) {
  const std::optional<Sim3> other_from_map = similarity_of_rays(
      options, map, other, rays_of(map, other, found, found_in_other), same_landmarks(map, found));
  if (!other_from_map) return std::nullopt;
  MapAlignment alignment{*other_from_map, agreeing(options, map, other, found, other_from_map->inverse()),
                         agreeing(options, other, map, found_in_other, *other_from_map)};
  if (alignment.found.empty()) return std::nullopt;
  return alignment;
}

}  // namespace

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map,
                                       const std::vector<KeyframeId>& keyframes, const Map& other,
                                       KeyframeId place) {
  FoundLandmarks found;
  for (const KeyframeId id : keyframes) {
    const Location location = locate(options, other, place, *map.keyframe(id)->image);
    if (location.found) found[id] = {location.matches.begin(), location.matches.end()};
    if (found.empty()) return std::nullopt;
  }
  if (found.size() < 2) return std::nullopt;
  return align_maps(options, map, other, std::move(found));
}

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       FoundLandmarks found) {
  FoundLandmarks found_in_other;
  for (const auto& [own, theirs] : same_landmarks(map, found)) {
    for (const Observation& seen : map.landmark(own)->observations)
      found[seen.keyframe].emplace(seen.feature, theirs);
    for (const Observation& seen : other.landmark(theirs)->observations)
      found_in_other[seen.keyframe].emplace(seen.feature, own);
  }
  return align(options, map, other, found, found_in_other);
}

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph) {
  std::vector<std::pair<KeyframeId, KeyframeId>> keyframes = pairs_to_compare(map, other, places);
  const auto node_of = [&](const Keyframe& keyframe) {
    return graph->add(keyframe.frame_index, keyframe.image);
  };
  std::vector<ViewGraph::Pair> edges;
  for (const auto& [own, theirs] : keyframes)
    edges.emplace_back(node_of(*map.keyframe(own)), node_of(*other.keyframe(theirs)));
  graph->connect(edges);
  FoundLandmarks found, found_in_other;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe &own = *map.keyframe(keyframes[i].first), &theirs = *other.keyframe(keyframes[i].second);
    for (const VerifiedMatch& m : graph->verified_matches(edges[i].first, edges[i].second)) {
      const LandmarkId own_id = own.landmark_of_feature[m.first],
                       their_id = theirs.landmark_of_feature[m.second];
      if (own_id != kNoLandmark) found_in_other[theirs.id].emplace(m.second, own_id);
      if (their_id != kNoLandmark) found[own.id].emplace(m.first, their_id);
    }
  }
  return align(options, map, other, found, found_in_other);
}

std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map, const FoundLandmarks& found) {
  std::map<LandmarkId, LandmarkId> same;
  for (const auto& [id, matches] : found) {
    for (const auto& [feature, landmark] : matches) {
      const LandmarkId own = map.keyframe(id)->landmark_of_feature[feature];
      if (own != kNoLandmark) same.emplace(own, landmark);
    }
  }
  return {same.begin(), same.end()};
}

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
    if (have_same_features(*map.keyframe(old->second)->image, *keyframe.image))
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

// Adds the newer map to the older one. Returns the keyframes that connect the two.
std::vector<KeyframeId> merge(const Map& newer, const MapAlignment& alignment, JoinedMaps* joined) {
  Map& map = joined->map;
  joined->scale = alignment.other_from_map.scale;
  joined->added = map.merge(newer, alignment.other_from_map);
  for (const auto& [own, theirs] : same_landmarks(newer, alignment.found))
    map.merge_landmarks(own + joined->added.landmarks, theirs);
  std::vector<KeyframeId> boundary;
  for (const auto& [id, matches] : alignment.found) {
    boundary.push_back(id + joined->added.keyframes);
    for (const auto& [feature, landmark] : matches) map.add_observation(landmark, boundary.back(), feature);
  }
  for (const auto& [old_id, new_id] : same_images(map, joined->added.keyframes)) {
    unite(old_id, new_id, &map);
    std::replace(boundary.begin(), boundary.end(), new_id, old_id);
    boundary.push_back(old_id);
  }
  return boundary;
}

// Adjusts with a wide loss first, so that the merged tracks have an effect before anything is culled. Returns
// the number of failed adjustments.
int adjust_boundary(const MapperOptions& options, const std::vector<KeyframeId>& boundary, Map* map) {
  const MappingOptions& mapping = options.mapping;
  std::vector<KeyframeId> window = boundary;
  for (const KeyframeId id : boundary) {
    for (const KeyframeId n : neighbors(*map, id, 2 * mapping.window_keyframes)) window.push_back(n);
  }
  window = sorted_unique(std::move(window));
  const auto adjust = [&](const BundleOptions& bundle) -> int {
    return adjust_keyframes(bundle, window, held_keyframes(mapping.window_keyframes),
                            mapping.window_landmarks, map)
        .failed;
  };
  int failed = adjust(with_wide_loss(options.bundle));
  const FlaggedFeatures none;
  const TrackExtender tracks(options, none, map);
  for (const KeyframeId id : boundary) {
    tracks.extend(id);
    tracks.create_landmarks(id, neighbors(*map, id, mapping.matching_keyframes));
  }
  failed += adjust(options.bundle);
  tracks.cull(map->landmark_ids());
  return failed;
}

}  // namespace

JoinedMaps join_maps(const MapperOptions& options, const Map& older, const Map& newer,
                     const MapAlignment& newer_in_older) {
  JoinedMaps joined;
  if (!older.has_ids_for(newer)) return joined;
  joined.map = older;
  const std::vector<KeyframeId> boundary = merge(newer, newer_in_older, &joined);
  const KeyframeId first_new = joined.added.keyframes;
  const int shared = points_across(joined.map, first_new);
  joined.failed_adjustments = adjust_boundary(options, boundary, &joined.map);
  const bool is_all_shared = joined.map.keyframes().rbegin()->first < first_new;
  joined.holds =
      is_all_shared || points_across(joined.map, first_new) >= std::max(options.min_inliers, shared / 2);
  return joined;
}

namespace {

// Aligns the points themselves, without the rays: the half of the inliers with the lowest depth uncertainty.
bool fit_points(const std::vector<SimilarityMatch>& observations, const std::vector<char>& inliers,
                Sim3* b_from_a) {
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (inliers[i]) sigmas.push_back(observations[i].depth_sigma());
  }
  if (sigmas.empty()) return false;
  const double most = median(std::move(sigmas));
  std::vector<Eigen::Vector3d> in_a, in_b;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!inliers[i] || observations[i].depth_sigma() > most) continue;
    in_a.push_back(observations[i].in_a.x);
    in_b.push_back(observations[i].in_b.x);
  }
  return align_sim3(in_a, in_b, b_from_a);
}

// Ratio of the actual to the expected depth errors: a landmark with many sharp observations is far better
// known than from two.
double share_of_depth_noise(const std::vector<SimilarityMatch>& observations, const Sim3& b_from_a) {
  std::vector<double> off;
  for (const SimilarityMatch& m : observations) {
    const double there = (b_from_a * m.in_a.x - m.in_b.center).norm(),
                 here = (m.in_b.x - m.in_b.center).norm();
    off.push_back(std::abs(std::log(there / here)) / m.depth_sigma());
  }
  return std::min(1.0, 1.48 * median(std::move(off)));
}

std::vector<SimilarityMatch> with_depth_noise(std::vector<SimilarityMatch> observations, double share,
                                              double bend) {
  for (SimilarityMatch& m : observations) {
    m.in_a.depth_sigma = std::hypot(bend, share * m.in_a.depth_sigma);
    m.in_b.depth_sigma = std::hypot(bend, share * m.in_b.depth_sigma);
  }
  return observations;
}

bool is_flipped(const SimilarityReport& one, const Sim3& other, double min_flip) {
  return one.b_from_a.rotation.angularDistance(other.rotation) > min_flip;
}

}  // namespace

std::optional<Sim3> resolve_flip(const std::vector<SimilarityMatch>& observations,
                                 const SimilarityOptions& options, const Sim3& found, int min_inliers) {
  constexpr OrientationFlipOptions flip{};
  Sim3 of_points;
  if (!fit_points(observations, refine_similarity_by_depths(observations, options, found).inliers,
                  &of_points))
    return found;
  const std::vector<SimilarityMatch> known =
      with_depth_noise(observations, share_of_depth_noise(observations, of_points), flip.bend);
  const SimilarityReport as_found = refine_similarity_by_depths(known, options, found),
                         from_points = refine_similarity_by_depths(known, options, of_points);
  const SimilarityReport& best = from_points.score < as_found.score ? from_points : as_found;
  if (best.num_inliers < min_inliers) return found;
  if (!best.success) return std::nullopt;
  return is_flipped(best, found, flip.min_flip) ? best.b_from_a : found;
}

}  // namespace mono_pose_tracker
