#include "mapping/graph_consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "common/statistics.h"
#include "keyframe_landmarks.h"
#include "mapping/map_joiner.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

namespace {

// The keyframe of each node of the graph; -1: not in the map.
std::vector<KeyframeId> keyframe_of_nodes(const Map& map, const ViewGraph& graph) {
  std::vector<KeyframeId> keyframes(graph.nodes().size(), -1);
  for (const auto& [id, keyframe] : map.keyframes()) {
    const int node = graph.node_of(keyframe.frame_index, keyframe.image);
    if (node >= 0) keyframes[node] = id;
  }
  return keyframes;
}

Rigid3 second_from_first(const Keyframe& first, const Keyframe& second) {
  return second.camera_from_map * first.camera_from_map.inverse();
}

// A match of the map's object: at least one of its features observes a landmark.
bool is_of_map(const Keyframe& first, const Keyframe& second, const Match& m) {
  return first.landmark_of_feature[m.first] != kNoLandmark ||
         second.landmark_of_feature[m.second] != kNoLandmark;
}

bool is_seen_at(const Map& map, LandmarkId id, const Keyframe& keyframe, const Rigid3& camera_from_map,
                int feature, double limit_rad) {
  const Eigen::Vector3d x_in_camera = camera_from_map * map.landmark(id)->x_in_map;
  return (x_in_camera.normalized() - keyframe.image->set.bearings[feature]).norm() < limit_rad;
}

bool is_seen_at(const Map& map, LandmarkId id, const Keyframe& keyframe, int feature, double limit_rad) {
  return is_seen_at(map, id, keyframe, keyframe.camera_from_map, feature, limit_rad);
}

// Whether the landmarks that the two features observe are elsewhere in the other image: the poses may explain
// a match, but not at this depth.
bool contradicts_landmarks(const Map& map, const Keyframe& first, const Keyframe& second, const Match& m,
                           double limit_rad) {
  const LandmarkId of_first = first.landmark_of_feature[m.first],
                   of_second = second.landmark_of_feature[m.second];
  if (of_first == of_second) return false;
  return !(of_first != kNoLandmark && is_seen_at(map, of_first, second, m.second, limit_rad)) &&
         !(of_second != kNoLandmark && is_seen_at(map, of_second, first, m.first, limit_rad));
}

EdgeConsistency consistency_of(const Map& map, const ViewGraph& graph, const ViewGraph::Pair& pair,
                               const TwoViewGeometry& geometry, KeyframeId first_id, KeyframeId second_id,
                               const GraphConsistencyOptions& options) {
  const Keyframe &first = *map.keyframe(first_id), &second = *map.keyframe(second_id);
  const std::vector<char> explained = graph.explained_by(pair, second_from_first(first, second));
  const double limit_rad = options.max_landmark_error * graph.max_error_rad(pair);
  std::array<int, 3> matches{}, agreeing{}, supported{};  // by motion
  for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
    const Match& m = geometry.matches[i];
    if (!is_of_map(first, second, m)) continue;
    const int motion = geometry.motion_of_match[i];
    ++matches[motion];
    agreeing[motion] += explained[i] != 0;
    supported[motion] += explained[i] != 0 && !contradicts_landmarks(map, first, second, m, limit_rad);
  }
  const int motion = matches[2] > matches[1] ? 2 : 1;
  return {pair, first_id, second_id, motion, matches[motion], agreeing[motion], supported[motion]};
}

// The moved pose of a keyframe of the segment, camera_from_rest; in the rest's unit.
Rigid3 moved(const Rigid3& camera_from_map, const Sim3& rest_from_segment) {
  const Eigen::Quaterniond rotation =
      (camera_from_map.rotation * rest_from_segment.rotation.conjugate()).normalized();
  return Rigid3(rotation, rest_from_segment.scale * camera_from_map.translation -
                              rotation * rest_from_segment.translation);
}

// Landmarks that enough of the keyframes observe to determine them alone.
std::set<LandmarkId> known_to(const Map& map, const std::set<KeyframeId>& keyframes, bool within) {
  std::set<LandmarkId> known;
  for (const auto& [id, landmark] : map.landmarks()) {
    const auto observers =
        std::count_if(landmark.observations.begin(), landmark.observations.end(),
                      [&](const Observation& o) { return (keyframes.count(o.keyframe) > 0) == within; });
    if (observers >= 2) known.insert(id);
  }
  return known;
}

// A match over the cut to a landmark that the other keyframes alone determine.
struct MatchToRest {
  KeyframeId keyframe = -1;  // of the segment
  int feature = -1;
  LandmarkId landmark = kNoLandmark;
  LandmarkId of_feature = kNoLandmark;  // that the segment alone determines
  KeyframeId of_rest = -1;              // keyframe and feature that observe the landmark
  int feature_of_rest = -1;

  bool operator<(const MatchToRest& o) const {
    return std::tie(keyframe, feature, landmark) < std::tie(o.keyframe, o.feature, o.landmark);
  }
};

std::set<MatchToRest> matches_to_rest(const Map& map, const ViewGraph& graph,
                                      const InconsistentSegment& segment) {
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
  const std::set<LandmarkId> in_segment = known_to(map, inside, true), in_rest = known_to(map, inside, false);
  std::set<MatchToRest> matches;
  for (const EdgeConsistency& edge : segment.cut) {
    const bool first_is_inside = inside.count(edge.first) > 0;
    const Keyframe &in = *map.keyframe(first_is_inside ? edge.first : edge.second),
                   &out = *map.keyframe(first_is_inside ? edge.second : edge.first);
    const auto [node_in, node_out] =
        first_is_inside ? edge.pair : ViewGraph::Pair(edge.pair.second, edge.pair.first);
    for (const VerifiedMatch& m : graph.verified_matches(node_in, node_out)) {
      const LandmarkId landmark = out.landmark_of_feature[m.second],
                       of_feature = in.landmark_of_feature[m.first];
      if (!in_rest.count(landmark)) continue;
      matches.insert({in.id, m.first, landmark, in_segment.count(of_feature) ? of_feature : kNoLandmark,
                      out.id, m.second});
    }
  }
  return matches;
}

bool is_explained(const Map& map, const MatchToRest& match, const Rigid3& camera_from_map, double limit_rad) {
  return is_seen_at(map, match.landmark, *map.keyframe(match.keyframe), camera_from_map, match.feature,
                    limit_rad);
}

// Poses of the segment's keyframes at another place; none for those that matches do not determine.
using Poses = std::map<KeyframeId, Rigid3>;

Poses move_as_one(const Map& map, const InconsistentSegment& segment, const std::set<MatchToRest>& matches,
                  const RansacOptions& ransac, int min_inliers, SegmentPlacement* place) {
  std::vector<RayToPoint> rays;
  std::vector<std::pair<LandmarkId, LandmarkId>>
      landmarks;  // that a pair of rays observes, one in each direction
  for (const MatchToRest& m : matches) {
    if (m.of_feature == kNoLandmark) continue;
    landmarks.emplace_back(m.of_feature, m.landmark);
    rays.push_back(
        ray_to_point(*map.keyframe(m.keyframe), m.feature, map.landmark(m.landmark)->x_in_map, true));
    rays.push_back(ray_to_point(*map.keyframe(m.of_rest), m.feature_of_rest,
                                map.landmark(m.of_feature)->x_in_map, false));
  }
  for (const MatchToRest& m : matches) {
    if (m.of_feature != kNoLandmark) continue;
    rays.push_back(
        ray_to_point(*map.keyframe(m.keyframe), m.feature, map.landmark(m.landmark)->x_in_map, true));
  }
  SimilarityOptions options;
  options.ransac = ransac;
  const SimilarityReport report = estimate_similarity_from_rays(rays, options);
  if (!report.success || report.num_inliers < 2 * min_inliers) return {};
  place->rest_from_segment = report.b_from_a;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (report.inliers[2 * i] && report.inliers[2 * i + 1]) place->merged.push_back(landmarks[i]);
  }
  Poses poses;
  for (const KeyframeId id : segment.keyframes)
    poses[id] = moved(map.keyframe(id)->camera_from_map, report.b_from_a);
  return poses;
}

Poses register_one_by_one(const Map& map, const std::set<MatchToRest>& matches, const RansacOptions& ransac,
                          int min_inliers) {
  struct Observed {
    std::vector<Eigen::Vector3d> bearings, points;
  };
  std::map<KeyframeId, Observed> of_keyframe;
  for (const MatchToRest& m : matches) {
    of_keyframe[m.keyframe].bearings.push_back(map.keyframe(m.keyframe)->image->set.bearings[m.feature]);
    of_keyframe[m.keyframe].points.push_back(map.landmark(m.landmark)->x_in_map);
  }
  const AbsolutePoseOptions options = AbsolutePoseOptions::in_growing_map(ransac);
  Poses poses;
  for (const auto& [id, observed] : of_keyframe) {
    const AbsolutePoseReport report = estimate_absolute_pose(observed.bearings, observed.points, options);
    if (report.success && report.num_inliers >= min_inliers) poses[id] = report.camera_from_map;
  }
  return poses;
}

void compare(const Map& map, const std::set<MatchToRest>& matches, const Poses& poses, double limit_rad,
             SegmentPlacement* place) {
  for (const MatchToRest& m : matches) {
    const bool by_map = is_explained(map, m, map.keyframe(m.keyframe)->camera_from_map, limit_rad);
    ++place->matches;
    place->by_map += by_map;
    const auto pose = poses.find(m.keyframe);
    if (pose == poses.end()) continue;
    const bool by_this = is_explained(map, m, pose->second, limit_rad);
    place->only_map += by_map && !by_this;
    place->only_this += !by_map && by_this;
  }
  place->p_value = binomial_tail(place->only_this, place->only_map + place->only_this, 0.5);
}

// Landmarks that both sides observe become two.
void split_landmarks(const std::set<KeyframeId>& inside, Map* map) {
  for (const LandmarkId id : map->landmark_ids()) {
    const Landmark landmark = *map->landmark(id);
    std::vector<Observation> within;
    for (const Observation& o : landmark.observations) {
      if (inside.count(o.keyframe)) within.push_back(o);
    }
    if (within.empty() || within.size() == landmark.observations.size()) continue;
    for (const Observation& o : within) map->remove_observation(id, o.keyframe);
    if (within.size() >= 2) {
      const LandmarkId split = map->add_landmark(landmark.x_in_map);
      for (const Observation& o : within) map->add_observation(split, o.keyframe, o.feature);
    }
    if (landmark.observations.size() - within.size() < 2) map->remove_landmark(id);
  }
}

// Logarithm of the likelihood ratio of the matches' own share of support to the allowed one; 0 where their
// share is not lower (the scan statistic of Kulldorff 1997, for Bernoulli trials).
double log_likelihood_ratio(int matches, int supported, double min_supported) {
  if (supported >= min_supported * matches) return 0;
  const double n = matches, k = supported;
  const double of_supported = k > 0 ? k * std::log(k / n / min_supported) : 0;
  return of_supported + (n - k) * std::log((n - k) / n / (1 - min_supported));
}

// The segment of these keyframes whose support over the cut is least likely; empty where none has less than
// the allowed share.
InconsistentSegment most_inconsistent(const std::vector<const Keyframe*>& in_time,
                                      const std::vector<EdgeConsistency>& edges,
                                      const GraphConsistencyOptions& options) {
  const auto count = static_cast<int>(in_time.size());
  const std::map<KeyframeId, int> place = places_in_time(in_time);
  std::vector<std::vector<std::pair<int, const EdgeConsistency*>>> neighbors(count);
  for (const EdgeConsistency& edge : edges) {
    const auto a = place.find(edge.first), b = place.find(edge.second);
    if (a == place.end() || b == place.end()) continue;
    neighbors[a->second].emplace_back(b->second, &edge);
    neighbors[b->second].emplace_back(a->second, &edge);
  }
  double best = 0;
  int best_begin = 0, best_end = 0;  // the segment is [begin, end)
  for (int begin = 0; begin < count; ++begin) {
    int matches = 0, supported = 0;
    for (int last = begin; last < std::min(count, begin + (count + 1) / 2); ++last) {
      for (const auto& [other, edge] : neighbors[last]) {
        const int sign = other >= begin && other < last ? -1 : 1;
        matches += sign * edge->matches;
        supported += sign * edge->supported;
      }
      const double ratio = log_likelihood_ratio(matches, supported, options.min_supported);
      if (ratio > best) best = ratio, best_begin = begin, best_end = last + 1;
    }
  }
  InconsistentSegment segment;
  for (int k = best_begin; k < best_end; ++k) segment.keyframes.push_back(in_time[k]->id);
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
  for (const EdgeConsistency& edge : edges) {
    if (!place.count(edge.first) || !place.count(edge.second) ||
        inside.count(edge.first) == inside.count(edge.second)) {
      continue;
    }
    segment.cut.push_back(edge);
    segment.matches += edge.matches;
    segment.supported += edge.supported;
  }
  segment.p_value =
      binomial_tail(segment.matches - segment.supported, segment.matches, 1 - options.min_supported);
  return segment;
}

}  // namespace

std::vector<EdgeConsistency> edge_consistency(const Map& map, const ViewGraph& graph,
                                              const GraphConsistencyOptions& options) {
  const std::vector<KeyframeId> keyframes = keyframe_of_nodes(map, graph);
  std::vector<EdgeConsistency> edges;
  for (const auto& [pair, geometry] : graph.edges()) {
    const KeyframeId first = keyframes[pair.first], second = keyframes[pair.second];
    if (first < 0 || second < 0 || geometry.type == TwoViewType::kDegenerate) continue;
    const EdgeConsistency edge = consistency_of(map, graph, pair, geometry, first, second, options);
    if (edge.matches >= options.min_inliers) edges.push_back(edge);
  }
  return edges;
}

std::vector<InconsistentSegment> inconsistent_segments(const Map& map,
                                                       const std::vector<EdgeConsistency>& edges,
                                                       const GraphConsistencyOptions& options) {
  std::vector<const Keyframe*> remaining = keyframes_in_time(map);
  const std::size_t keyframes = remaining.size();
  const double limit = options.significance / (0.5 * static_cast<double>(keyframes * (keyframes + 1)));
  std::vector<InconsistentSegment> segments;
  for (std::size_t found = 0; 2 * found < keyframes;) {
    InconsistentSegment segment = most_inconsistent(remaining, edges, options);
    if (segment.keyframes.empty() || segment.p_value > limit) break;
    const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
    remaining.erase(std::remove_if(remaining.begin(), remaining.end(),
                                   [&](const Keyframe* keyframe) { return inside.count(keyframe->id) > 0; }),
                    remaining.end());
    found += inside.size();
    segments.push_back(std::move(segment));
  }
  return segments;
}

SegmentPlacement other_place(const Map& map, const ViewGraph& graph, const InconsistentSegment& segment,
                             const GraphConsistencyOptions& options) {
  const std::set<MatchToRest> matches = matches_to_rest(map, graph, segment);
  RansacOptions ransac = graph.options().ransac;
  for (const EdgeConsistency& edge : segment.cut)
    ransac.threshold = std::max(ransac.threshold, graph.max_error_rad(edge.pair));
  const double limit_rad = options.max_landmark_error * ransac.threshold;
  SegmentPlacement as_one, one_by_one;
  compare(map, matches, move_as_one(map, segment, matches, ransac, options.min_inliers, &as_one), limit_rad,
          &as_one);
  compare(map, matches, register_one_by_one(map, matches, ransac, options.min_inliers), limit_rad,
          &one_by_one);
  const bool is_one = as_one.only_this - as_one.only_map >= one_by_one.only_this - one_by_one.only_map;
  return is_one ? as_one : one_by_one;
}

std::map<KeyframeId, Sim3> move_segment(const InconsistentSegment& segment, const SegmentPlacement& place,
                                        Map* map) {
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
  split_landmarks(inside, map);
  std::map<KeyframeId, Sim3> changes;
  for (const auto& entry : map->keyframes())
    changes[entry.first] = inside.count(entry.first) ? *place.rest_from_segment : Sim3();
  map->apply(changes);
  for (const auto& [of_segment, of_rest] : place.merged) {
    if (map->landmark(of_segment) && map->landmark(of_rest)) map->merge_landmarks(of_segment, of_rest);
  }
  return changes;
}

std::set<std::int64_t> unsupported_images(const ViewGraph& graph,
                                          const std::map<std::int64_t, Rigid3>& camera_from_map,
                                          const GraphConsistencyOptions& options) {
  struct Features {
    std::set<int> explained, in_map, elsewhere;
  };
  std::map<int, Features> of_node;  // with a pose
  for (const auto& [pair, geometry] : graph.edges()) {
    const auto first = camera_from_map.find(graph.nodes()[pair.first].frame_index),
               second = camera_from_map.find(graph.nodes()[pair.second].frame_index);
    const bool has_first = first != camera_from_map.end(), has_second = second != camera_from_map.end();
    const bool has_both = has_first && has_second;
    std::vector<char> by_poses;
    if (has_both) by_poses = graph.explained_by(pair, second->second * first->second.inverse());
    for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
      const Match& m = geometry.matches[i];
      if (geometry.motion_of_match[i] == 0) continue;
      const auto note = [&](int node, int feature) {
        Features& features = of_node[node];
        (has_both ? features.in_map : features.elsewhere).insert(feature);
        if (has_both && by_poses[i]) features.explained.insert(feature);
      };
      if (has_first) note(pair.first, m.first);
      if (has_second) note(pair.second, m.second);
    }
  }
  std::set<std::int64_t> unsupported;
  for (const auto& [node, features] : of_node) {
    const auto explained = static_cast<double>(features.explained.size()),
               elsewhere = static_cast<double>(std::count_if(
                   features.elsewhere.begin(), features.elsewhere.end(),
                   [&, in_map = &features.in_map](int feature) { return in_map->count(feature) == 0; }));
    if (explained < options.min_explained * (explained + elsewhere))
      unsupported.insert(graph.nodes()[node].frame_index);
  }
  return unsupported;
}

double ExplainedDifference::p_value() const { return binomial_tail(gained, gained + lost, 0.5); }

ExplainedDifference compare_explained(const Map& before, const Map& after, const ViewGraph& graph) {
  const std::vector<KeyframeId> keyframes = keyframe_of_nodes(after, graph);
  ExplainedDifference difference;
  for (const auto& [pair, geometry] : graph.edges()) {
    const KeyframeId first = keyframes[pair.first], second = keyframes[pair.second];
    if (first < 0 || second < 0) continue;
    const std::vector<char> by_old = graph.explained_by(
                                pair, second_from_first(*before.keyframe(first), *before.keyframe(second))),
                            by_new = graph.explained_by(
                                pair, second_from_first(*after.keyframe(first), *after.keyframe(second)));
    for (std::size_t i = 0; i < by_new.size(); ++i) {
      if (geometry.motion_of_match[i] == 0) continue;
      difference.gained += by_new[i] && !by_old[i];
      difference.lost += by_old[i] && !by_new[i];
    }
  }
  return difference;
}

}  // namespace mono_pose_tracker
