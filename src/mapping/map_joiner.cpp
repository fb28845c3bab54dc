#include "mapping/map_joiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "common/median.h"
#include "landmark_parallax.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "orientation_flip.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

namespace {

// px of parallax at 640 px (image_scale) at which features with 0.6 px noise determine a depth to a fifth.
constexpr double kKnownDepthPx = 4.2;
constexpr double kKnownDepthSigma = 0.2;
constexpr double kLeastParallax = 1e-6;  // rad: without parallax there is no depth
// Common points in one keyframe: fewer do not determine the scale.
constexpr int kMinPoints = 10;
// px at 640 px (image_scale): drift between the two keyframes in either map adds to the error of the matches.
constexpr double kMaxDisagreement = 12;

// kKnownDepthPx in rad.
double known_depth_parallax(const Keyframe& keyframe) {
  return kKnownDepthPx * image_scale(keyframe.image->camera) / keyframe.image->camera.focal();
}

// Scale between the maps from the depths of points known in both: log of the median ratio (other over map),
// and its standard error. Far points have no parallax in either map and are ignored.
bool scale_between(const Map& map, const Keyframe& keyframe, const Map& other, const Location& location,
                   double* log_scale, double* sigma) {
  const double known = known_depth_parallax(keyframe);
  std::vector<double> ratios;
  for (const auto& [feature, landmark] : location.matches) {
    const LandmarkId own = keyframe.landmark_of_feature[feature];
    if (own == kNoLandmark || !has_parallax(map, *map.landmark(own), known) ||
        !has_parallax(other, *other.landmark(landmark), known)) {
      continue;
    }
    const double here = (keyframe.camera_from_map * map.landmark(own)->x_in_map).norm();
    const double there = (location.camera_from_map * other.landmark(landmark)->x_in_map).norm();
    if (here > 0 && there > 0) ratios.push_back(std::log(there / here));
  }
  if (static_cast<int>(ratios.size()) < kMinPoints) return false;
  *log_scale = median(ratios);
  std::vector<double> off(ratios.size());
  std::transform(ratios.begin(), ratios.end(), off.begin(),
                 [&](double ratio) { return std::abs(ratio - *log_scale); });
  // The median of n normal values spreads by 1.25 sigma / sqrt(n); sigma is 1.48 median deviations.
  *sigma = 1.25 * 1.48 * median(std::move(off)) / std::sqrt(static_cast<double>(ratios.size()));
  return true;
}

Sim3 similarity(const Rigid3& camera_from_map, const Rigid3& camera_from_other, double scale) {
  const Sim3 scaled_camera_from_map(scale, camera_from_map.rotation, scale * camera_from_map.translation);
  return Sim3(camera_from_other.inverse()) * scaled_camera_from_map;
}

// Median reprojection error of b's points under a's similarity, px.
double disagreement(const Map& map, const Map& other, const MapMatch& a, const MapMatch& b) {
  const Keyframe& keyframe = *map.keyframe(b.keyframe);
  const CameraModel& camera = keyframe.image->camera;
  const Sim3& s = a.other_from_map;
  std::vector<double> errors;
  for (const auto& [feature, landmark] : b.location.matches) {
    const Eigen::Vector3d x_in_map =
        s.rotation.conjugate() * (other.landmark(landmark)->x_in_map - s.translation) / s.scale;
    Eigen::Vector2d pixel;
    errors.push_back(camera.project(keyframe.camera_from_map * x_in_map, &pixel)
                         ? (pixel - keyframe.image->set.features[feature].pixel.cast<double>()).norm()
                         : 1e6);
  }
  return median(std::move(errors));
}

// The observations of a landmark by the first and the last keyframe, which constrain its depth most.
// depth_sigma: of two observations with 0.6 px noise.
std::array<ObservedPoint, 2> observations_of(const Map& map, LandmarkId id) {
  const Landmark& landmark = *map.landmark(id);
  const double parallax = std::max(widest_parallax(map, landmark), kLeastParallax);
  const auto as_seen = [&](const Observation& seen) {
    const Keyframe& keyframe = *map.keyframe(seen.keyframe);
    ObservedPoint observation = observed_point(keyframe, seen.feature, landmark.x_in_map);
    observation.depth_sigma = kKnownDepthSigma * known_depth_parallax(keyframe) / parallax;
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

// The similarity of the common landmarks; none where they do not determine it.
std::optional<Sim3> similarity_of_points(const MapperOptions& options, const Map& map, const Map& other,
                                         const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  SimilarityOptions similarity;
  similarity.ransac = options.ransac;
  const std::vector<SimilarityMatch> point_pairs = paired_observations(map, other, same);
  SimilarityReport report = estimate_similarity(point_pairs, similarity);
  report = similarity_from_points(point_pairs, similarity, report);
  report = resolve_flip_by_depths(point_pairs, similarity, report);
  // Each point has two observations.
  if (!report.success || report.num_inliers < 2 * options.min_inliers) return std::nullopt;
  return report.b_from_a;
}

// The similarity by which cameras of both maps observe landmarks of the other; by the common landmarks, where
// they are enough, as rays alone leave two orientations of a small planar patch.
std::optional<Sim3> similarity_of_rays(const MapperOptions& options, const Map& map, const Map& other,
                                       const std::vector<RayToPoint>& rays,
                                       const std::vector<std::pair<LandmarkId, LandmarkId>>& same) {
  SimilarityOptions similarity;
  similarity.ransac = options.ransac;
  const SimilarityReport found = estimate_similarity_from_rays(rays, similarity);
  // A common landmark has a ray in either direction.
  if (!found.success || found.num_inliers < 2 * options.min_inliers) return std::nullopt;
  const std::vector<SimilarityMatch> point_pairs = paired_observations(map, other, same);
  SimilarityReport report = refine_similarity(point_pairs, similarity, found.b_from_a);
  if (report.num_inliers < 2 * options.min_inliers) return found.b_from_a;
  report = similarity_from_points(point_pairs, similarity, report);
  report = resolve_flip_by_depths(point_pairs, similarity, report);
  if (!report.success) return std::nullopt;
  return report.b_from_a;
}

// Keyframe pairs of the two maps that may show the same place: nearest in time, and similar ones.
std::vector<std::pair<KeyframeId, KeyframeId>> pairs_to_compare(const Map& map, const Map& other,
                                                                const PlaceFinder& places) {
  constexpr std::size_t kNearest = 12, kAsked = 40;
  constexpr int kPlaces = 3;
  const std::size_t step = 1 + map.keyframes().size() / kAsked;
  std::size_t number = 0;
  std::vector<std::tuple<std::int64_t, KeyframeId, KeyframeId>> by_time;
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const auto& [other_id, other_keyframe] : other.keyframes())
      by_time.emplace_back(std::abs(keyframe.frame_index - other_keyframe.frame_index), id, other_id);
    if (number++ % step != 0) continue;
    for (const KeyframeId place : places.find(keyframe.image->set, kPlaces)) {
      if (other.keyframe(place)) pairs.emplace(id, place);
    }
  }
  const auto end = by_time.begin() + static_cast<std::ptrdiff_t>(std::min(kNearest, by_time.size()));
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

}  // namespace

std::optional<MapMatch> match_keyframe(const MapperOptions& options, const Map& map, KeyframeId keyframe_id,
                                       const Map& other, KeyframeId place) {
  const Keyframe& keyframe = *map.keyframe(keyframe_id);
  MapMatch map_match;
  map_match.keyframe = keyframe_id;
  map_match.location = locate(options, other, place, *keyframe.image);
  double log_scale;
  if (!map_match.location.found ||
      !scale_between(map, keyframe, other, map_match.location, &log_scale, &map_match.log_scale_sigma) ||
      map_match.log_scale_sigma > SimilarityOptions().max_scale_sigma) {
    return std::nullopt;
  }
  map_match.other_from_map =
      similarity(keyframe.camera_from_map, map_match.location.camera_from_map, std::exp(log_scale));
  return map_match;
}

bool map_matches_agree(const Map& map, const Map& other, const MapMatch& a, const MapMatch& b) {
  const auto limit = [&](const MapMatch& map_match) {
    return kMaxDisagreement * image_scale(map.keyframe(map_match.keyframe)->image->camera);
  };
  return disagreement(map, other, a, b) < limit(b) && disagreement(map, other, b, a) < limit(a);
}

std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       MapMatch first, MapMatch second) {
  if (!map_matches_agree(map, other, first, second)) return std::nullopt;
  MapAlignment alignment;
  alignment.map_matches = {std::move(first), std::move(second)};
  const std::optional<Sim3> other_from_map =
      similarity_of_points(options, map, other, same_landmarks(map, alignment.map_matches));
  if (!other_from_map) return std::nullopt;
  alignment.other_from_map = *other_from_map;
  return alignment;
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
  std::map<KeyframeId, std::map<int, LandmarkId>> found;  // by keyframe: (feature, landmark of the other map)
  std::map<KeyframeId, std::map<int, LandmarkId>>
      found_in_other;  // of the other's: (feature, landmark of this)
  std::set<std::pair<LandmarkId, LandmarkId>> paired;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe &own = *map.keyframe(keyframes[i].first), &theirs = *other.keyframe(keyframes[i].second);
    for (const auto& [feature, their_feature] : same_features(*graph, edges[i].first, edges[i].second)) {
      const LandmarkId own_id = own.landmark_of_feature[feature],
                       their_id = theirs.landmark_of_feature[their_feature];
      if (own_id != kNoLandmark) found_in_other[theirs.id].emplace(their_feature, own_id);
      if (their_id == kNoLandmark) continue;
      if (own_id != kNoLandmark) paired.emplace(own_id, their_id);
      found[own.id].emplace(feature, their_id);
    }
  }
  std::vector<RayToPoint> rays;
  for (const auto& [id, matches] : found) {
    for (const auto& [feature, landmark] : matches)
      rays.push_back(ray_to_point(*map.keyframe(id), feature, other.landmark(landmark)->x_in_map, true));
  }
  for (const auto& [id, matches] : found_in_other) {
    for (const auto& [feature, landmark] : matches)
      rays.push_back(ray_to_point(*other.keyframe(id), feature, map.landmark(landmark)->x_in_map, false));
  }
  const std::optional<Sim3> other_from_map =
      similarity_of_rays(options, map, other, rays, {paired.begin(), paired.end()});
  if (!other_from_map) return std::nullopt;
  MapAlignment alignment;
  alignment.other_from_map = *other_from_map;
  for (const auto& [id, matches] : found) {
    const Keyframe& keyframe = *map.keyframe(id);
    const double limit = kMaxDisagreement * image_scale(keyframe.image->camera);
    MapMatch map_match;
    map_match.keyframe = id;
    map_match.other_from_map = *other_from_map;
    for (const auto& [feature, landmark] : matches) {
      const Eigen::Vector3d x_in_map = other_from_map->inverse() * other.landmark(landmark)->x_in_map;
      if (reprojection_error(*keyframe.image, feature, keyframe.camera_from_map * x_in_map).norm() < limit)
        map_match.location.matches.emplace_back(feature, landmark);
    }
    if (static_cast<int>(map_match.location.matches.size()) >= options.min_inliers)
      alignment.map_matches.push_back(std::move(map_match));
  }
  if (alignment.map_matches.empty()) return std::nullopt;
  return alignment;
}

std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map,
                                                              const std::vector<MapMatch>& map_matches) {
  std::map<LandmarkId, LandmarkId> same;
  for (const MapMatch& map_match : map_matches) {
    for (const auto& [feature, landmark] : map_match.location.matches) {
      const LandmarkId own = map.keyframe(map_match.keyframe)->landmark_of_feature[feature];
      if (own != kNoLandmark) same.emplace(own, landmark);
    }
  }
  return {same.begin(), same.end()};
}

}  // namespace mono_pose_tracker
