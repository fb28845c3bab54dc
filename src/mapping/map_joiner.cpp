#include "mapping/map_joiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "landmark_parallax.h"
#include "mapping/keyframe_locator.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

namespace {

constexpr double kLeastParallax = 1e-6;  // rad: without parallax there is no depth

// The parallax at which a depth is known, in rad.
double known_depth_parallax(const MapJoinerOptions& joiner, const Keyframe& keyframe) {
  return joiner.known_depth_px * image_scale(keyframe.image->camera) / keyframe.image->camera.focal();
}

// The observations of a landmark by the first and the last keyframe, which constrain its depth most.
// depth_sigma: of two observations with 0.6 px noise.
std::array<ObservedPoint, 2> observations_of(const MapJoinerOptions& joiner, const Map& map, LandmarkId id) {
  const Landmark& landmark = *map.landmark(id);
  const double parallax = std::max(widest_parallax(map, landmark), kLeastParallax);
  const auto as_seen = [&](const Observation& seen) {
    const Keyframe& keyframe = *map.keyframe(seen.keyframe);
    ObservedPoint observation = observed_point(keyframe, seen.feature, landmark.x_in_map);
    observation.depth_sigma = joiner.known_depth_sigma * known_depth_parallax(joiner, keyframe) / parallax;
    return observation;
  };
  return {as_seen(landmark.observations.front()), as_seen(landmark.observations.back())};
}

std::vector<SimilarityMatch> paired_observations(const MapJoinerOptions& joiner, const Map& map,
                                                 const Map& other,
                                                 const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  std::vector<SimilarityMatch> point_pairs;
  for (const auto& [own, theirs] : same) {
    const std::array<ObservedPoint, 2> in_map = observations_of(joiner, map, own),
                                       in_other = observations_of(joiner, other, theirs);
    for (std::size_t k = 0; k < in_map.size(); ++k) point_pairs.push_back({in_map[k], in_other[k]});
  }
  return point_pairs;
}

// The similarity by which cameras of both maps observe landmarks of the other; by the common landmarks, where
// they are enough, as rays alone leave two orientations of a small planar patch.
std::optional<Sim3> similarity_of_rays(const MapperOptions& options, const MapJoinerOptions& joiner,
                                       const Map& map, const Map& other, const std::vector<RayToPoint>& rays,
                                       const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  SimilarityOptions similarity;
  similarity.ransac = options.ransac;
  const SimilarityReport found = estimate_similarity_from_rays(rays, similarity);
  // A common landmark has at least one ray in either direction.
  if (!found.success || found.num_inliers < 2 * options.min_inliers) return std::nullopt;
  // Each common point has two observations.
  return resolve_flip(paired_observations(joiner, map, other, same), similarity, found.b_from_a,
                      2 * options.min_inliers, joiner.flip);
}

// Keyframe pairs of the two maps that may show the same place: nearest in time, and similar ones.
std::vector<std::pair<KeyframeId, KeyframeId>> pairs_to_compare(const MapJoinerOptions& joiner,
                                                                const Map& map, const Map& other,
                                                                const PlaceFinder& places) {
  const std::size_t step = 1 + map.keyframes().size() / joiner.asked_keyframes;
  std::size_t number = 0;
  std::vector<std::tuple<std::int64_t, KeyframeId, KeyframeId>> by_time;
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const auto& [other_id, other_keyframe] : other.keyframes())
      by_time.emplace_back(std::abs(keyframe.frame_index - other_keyframe.frame_index), id, other_id);
    if (number++ % step != 0) continue;
    for (const KeyframeId place : places.find(keyframe.image->set, joiner.similar_places)) {
      if (other.keyframe(place)) pairs.emplace(id, place);
    }
  }
  const auto end =
      by_time.begin() + static_cast<std::ptrdiff_t>(std::min(joiner.nearest_pairs, by_time.size()));
  std::partial_sort(by_time.begin(), end, by_time.end());
  for (auto nearest = by_time.begin(); nearest != end; ++nearest)
    pairs.emplace(std::get<1>(*nearest), std::get<2>(*nearest));
  return {pairs.begin(), pairs.end()};
}

// Matching features of two images: verified matches, or each feature with itself where the image is the same.
std::vector<std::pair<int, int>> same_features(const ViewGraph& graph, int node, int other) {
  std::vector<std::pair<int, int>> same;
  if (node == other) {
    for (int f = 0; f < graph.nodes()[node].image->size(); ++f) same.emplace_back(f, f);
    return same;
  }
  const TwoViewGeometry& geometry = *graph.edge(std::min(node, other), std::max(node, other));
  for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
    if (geometry.motion_of_match[i] == 0) continue;
    const Match& m = geometry.matches[i];
    same.push_back(node < other ? std::pair(m.first, m.second) : std::pair(m.second, m.first));
  }
  return same;
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
FoundLandmarks agreeing(const MapperOptions& options, double max_disagreement_px, const Map& map,
                        const Map& other, const FoundLandmarks& found, const Sim3& map_from_other) {
  FoundLandmarks agreeing;
  for (const auto& [id, matches] : found) {
    const Keyframe& keyframe = *map.keyframe(id);
    const double limit = max_disagreement_px * image_scale(keyframe.image->camera);
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

std::optional<MapAlignment> align(const MapperOptions& options, const MapJoinerOptions& joiner,
                                  const Map& map, const Map& other, const FoundLandmarks& found,
                                  const FoundLandmarks& found_in_other) {
  const std::optional<Sim3> other_from_map = similarity_of_rays(
      options, joiner, map, other, rays_of(map, other, found, found_in_other), same_landmarks(map, found));
  if (!other_from_map) return std::nullopt;
  MapAlignment alignment{
      *other_from_map,
      agreeing(options, joiner.max_disagreement_px, map, other, found, other_from_map->inverse()),
      agreeing(options, joiner.max_disagreement_px, other, map, found_in_other, *other_from_map)};
  if (alignment.found.empty()) return std::nullopt;
  return alignment;
}

}  // namespace

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map,
                                       const std::vector<KeyframeId>& keyframes, const Map& other,
                                       KeyframeId place, const MapJoinerOptions& joiner) {
  FoundLandmarks found;
  for (const KeyframeId id : keyframes) {
    const Location location = locate(options, other, place, *map.keyframe(id)->image);
    if (location.found) found[id] = {location.matches.begin(), location.matches.end()};
    if (found.empty()) return std::nullopt;
  }
  if (found.size() < 2) return std::nullopt;
  return align_maps(options, map, other, std::move(found), joiner);
}

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       FoundLandmarks found, const MapJoinerOptions& joiner) {
  FoundLandmarks found_in_other;
  for (const auto& [own, theirs] : same_landmarks(map, found)) {
    for (const Observation& seen : map.landmark(own)->observations)
      found[seen.keyframe].emplace(seen.feature, theirs);
    for (const Observation& seen : other.landmark(theirs)->observations)
      found_in_other[seen.keyframe].emplace(seen.feature, own);
  }
  return align(options, joiner, map, other, found, found_in_other);
}

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph,
                                       const MapJoinerOptions& joiner) {
  std::vector<std::pair<KeyframeId, KeyframeId>> keyframes = pairs_to_compare(joiner, map, other, places);
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
    for (const auto& [feature, their_feature] : same_features(*graph, edges[i].first, edges[i].second)) {
      const LandmarkId own_id = own.landmark_of_feature[feature],
                       their_id = theirs.landmark_of_feature[their_feature];
      if (own_id != kNoLandmark) found_in_other[theirs.id].emplace(their_feature, own_id);
      if (their_id != kNoLandmark) found[own.id].emplace(feature, their_id);
    }
  }
  return align(options, joiner, map, other, found, found_in_other);
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

}  // namespace mono_pose_tracker
