#include "mapping/graph_consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "keyframe_landmarks.h"
#include "orientation_flip.h"
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

bool pairs_landmarks(const Keyframe& first, const Keyframe& second, const Match& m) {
  return first.landmark_of_feature[m.first] != kNoLandmark &&
         second.landmark_of_feature[m.second] != kNoLandmark;
}

bool is_seen_at(const Map& map, LandmarkId id, const Keyframe& keyframe, int feature, double limit_rad) {
  const Eigen::Vector3d x_in_camera = keyframe.camera_from_map * map.landmark(id)->x_in_map;
  return (x_in_camera.normalized() - keyframe.image->set.bearings[feature]).norm() < limit_rad;
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
  EdgeConsistency edge;
  edge.pair = pair;
  edge.first = first_id;
  edge.second = second_id;
  edge.motion = motion;
  edge.matches = matches[motion];
  edge.explained = agreeing[motion];
  edge.supported = supported[motion];
  edge.p_value = binomial_tail(edge.matches - edge.explained, edge.matches, 0.5);
  return edge;
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

struct PairedLandmarks {
  std::vector<SimilarityMatch> matches;
  std::vector<std::pair<ViewGraph::Pair, int>> source;  // edge and match
};

PairedLandmarks paired_landmarks(const Map& map, const ViewGraph& graph, const InconsistentSegment& segment) {
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
  const std::set<LandmarkId> in_segment = known_to(map, inside, true), in_rest = known_to(map, inside, false);
  PairedLandmarks paired;
  for (const EdgeConsistency& edge : segment.cut) {
    const Keyframe &first = *map.keyframe(edge.first), &second = *map.keyframe(edge.second);
    const bool first_is_inside = inside.count(edge.first) > 0;
    const TwoViewGeometry& geometry = *graph.edge(edge.pair.first, edge.pair.second);
    for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
      const Match& m = geometry.matches[i];
      if (geometry.motion_of_match[i] == 0 || !pairs_landmarks(first, second, m)) continue;
      const Keyframe &in = first_is_inside ? first : second, &out = first_is_inside ? second : first;
      const int in_feature = first_is_inside ? m.first : m.second,
                out_feature = first_is_inside ? m.second : m.first;
      const LandmarkId in_id = in.landmark_of_feature[in_feature],
                       out_id = out.landmark_of_feature[out_feature];
      if (!in_segment.count(in_id) || !in_rest.count(out_id)) continue;
      paired.matches.push_back({observed_point(in, in_feature, map.landmark(in_id)->x_in_map),
                                observed_point(out, out_feature, map.landmark(out_id)->x_in_map)});
      paired.source.emplace_back(edge.pair, static_cast<int>(i));
    }
  }
  return paired;
}

}  // namespace

double binomial_tail(int k, int n, double probability) {
  if (k <= 0) return 1;
  if (k > n || probability <= 0) return 0;
  if (probability >= 1) return 1;
  double sum = 0;
  for (int i = k; i <= n; ++i) {
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(i + 1.0) - std::lgamma(n - i + 1.0) +
                    i * std::log(probability) + (n - i) * std::log1p(-probability));
  }
  return std::min(1.0, sum);
}

double significant_p_value(std::vector<double> p_values, double false_discovery_rate) {
  std::sort(p_values.begin(), p_values.end());
  double significant = 0;
  for (std::size_t i = 0; i < p_values.size(); ++i) {
    const double allowed =
        false_discovery_rate * static_cast<double>(i + 1) / static_cast<double>(p_values.size());
    if (p_values[i] <= allowed) significant = p_values[i];
  }
  return significant;
}

std::vector<EdgeConsistency> edge_consistency(const Map& map, const ViewGraph& graph,
                                              const GraphConsistencyOptions& options) {
  const std::vector<KeyframeId> keyframes = keyframe_of_nodes(map, graph);
  std::vector<EdgeConsistency> edges;
  std::vector<double> p_values;
  for (const auto& [pair, geometry] : graph.edges()) {
    const KeyframeId first = keyframes[pair.first], second = keyframes[pair.second];
    if (first < 0 || second < 0 || geometry.type == TwoViewType::kDegenerate) continue;
    const EdgeConsistency edge = consistency_of(map, graph, pair, geometry, first, second, options);
    if (edge.matches < options.min_inliers) continue;
    edges.push_back(edge);
    p_values.push_back(edge.p_value);
  }
  const double limit = significant_p_value(p_values, options.significance);
  for (EdgeConsistency& edge : edges) edge.is_inconsistent = edge.p_value <= limit;
  return edges;
}

std::set<KeyframeId> contradicted_keyframes(const std::vector<EdgeConsistency>& edges,
                                            const GraphConsistencyOptions& options) {
  struct Matches {
    int supported = 0, all = 0;
    std::vector<const EdgeConsistency*> edges;
    double share() const { return all > 0 ? static_cast<double>(supported) / all : 1; }
  };
  std::map<KeyframeId, Matches> of_keyframe;
  for (const EdgeConsistency& edge : edges) {
    for (const KeyframeId id : {edge.first, edge.second}) {
      of_keyframe[id].supported += edge.supported;
      of_keyframe[id].all += edge.matches;
      of_keyframe[id].edges.push_back(&edge);
    }
  }
  std::set<KeyframeId> contradicted;
  while (!of_keyframe.empty()) {
    const auto worst =
        std::min_element(of_keyframe.begin(), of_keyframe.end(),
                         [](const auto& a, const auto& b) { return a.second.share() < b.second.share(); });
    if (worst->second.share() >= options.min_supported) break;
    for (const EdgeConsistency* edge : worst->second.edges) {
      const auto other = of_keyframe.find(edge->first == worst->first ? edge->second : edge->first);
      if (other == of_keyframe.end()) continue;
      other->second.supported -= edge->supported;
      other->second.all -= edge->matches;
    }
    contradicted.insert(worst->first);
    of_keyframe.erase(worst);
  }
  return contradicted;
}

std::optional<InconsistentSegment> most_inconsistent_segment(const Map& map,
                                                             const std::vector<EdgeConsistency>& edges) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  const auto count = static_cast<int>(in_time.size());
  std::map<KeyframeId, int> place;
  for (int k = 0; k < count; ++k) place[in_time[k]->id] = k;
  // Surplus of contradicting matches over explained ones, by edge.
  std::vector<std::vector<std::pair<int, int>>> neighbors(count);
  const auto contradicting = [](const EdgeConsistency& edge) {
    return edge.is_inconsistent ? edge.matches - edge.explained : 0;
  };
  bool any = false;
  for (const EdgeConsistency& edge : edges) {
    const int a = place.at(edge.first), b = place.at(edge.second),
              surplus = contradicting(edge) - edge.explained;
    neighbors[a].emplace_back(b, surplus);
    neighbors[b].emplace_back(a, surplus);
    any = any || edge.is_inconsistent;
  }
  if (!any) return std::nullopt;
  int best = 0, best_begin = 0, best_end = 0;  // the segment is [begin, end)
  for (int begin = 0; begin < count; ++begin) {
    int surplus = 0;
    for (int last = begin; last < std::min(count, begin + (count + 1) / 2); ++last) {
      for (const auto& [other, weight] : neighbors[last]) {
        surplus += other >= begin && other < last ? -weight : weight;
      }
      if (surplus > best) best = surplus, best_begin = begin, best_end = last + 1;
    }
  }
  if (best <= 0) return std::nullopt;
  InconsistentSegment segment;
  for (int k = best_begin; k < best_end; ++k) segment.keyframes.push_back(in_time[k]->id);
  for (const EdgeConsistency& edge : edges) {
    const auto is_inside = [&](KeyframeId id) {
      return place.at(id) >= best_begin && place.at(id) < best_end;
    };
    if (is_inside(edge.first) == is_inside(edge.second)) continue;
    segment.cut.push_back(edge);
    segment.contradicting += contradicting(edge);
    segment.explained += edge.explained;
  }
  return segment;
}

std::optional<SegmentAlignment> align_segment(const Map& map, const ViewGraph& graph,
                                              const InconsistentSegment& segment) {
  const PairedLandmarks paired = paired_landmarks(map, graph, segment);
  SimilarityOptions options;
  options.ransac = graph.options().ransac;
  for (const EdgeConsistency& edge : segment.cut)
    options.ransac.threshold = std::max(options.ransac.threshold, graph.max_error_rad(edge.pair));
  const SimilarityReport report = estimate_similarity(paired.matches, options);
  if (!report.success || report.num_inliers < graph.options().min_inliers) return std::nullopt;
  SegmentAlignment alignment;
  alignment.rest_from_segment = report.b_from_a;
  for (std::size_t i = 0; i < paired.source.size(); ++i) {
    if (report.inliers[i]) alignment.inliers.push_back(paired.source[i]);
  }
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
  for (const EdgeConsistency& edge : segment.cut) {
    const Keyframe &first = *map.keyframe(edge.first), &second = *map.keyframe(edge.second);
    const auto pose = [&](const Keyframe& keyframe) {
      return inside.count(keyframe.id) ? moved(keyframe.camera_from_map, alignment.rest_from_segment)
                                       : keyframe.camera_from_map;
    };
    const TwoViewGeometry& geometry = *graph.edge(edge.pair.first, edge.pair.second);
    const std::vector<char> by_map = graph.explained_by(edge.pair, second_from_first(first, second)),
                            by_this = graph.explained_by(edge.pair, pose(second) * pose(first).inverse());
    for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
      if (geometry.motion_of_match[i] == 0 || !is_of_map(first, second, geometry.matches[i])) continue;
      alignment.only_map += by_map[i] && !by_this[i];
      alignment.only_this += !by_map[i] && by_this[i];
    }
  }
  alignment.p_value = binomial_tail(alignment.only_this, alignment.only_map + alignment.only_this, 0.5);
  return alignment;
}

std::map<KeyframeId, Sim3> apply_alignment(const InconsistentSegment& segment,
                                           const SegmentAlignment& alignment, const ViewGraph& graph,
                                           Map* map) {
  const std::set<KeyframeId> inside(segment.keyframes.begin(), segment.keyframes.end());
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
  std::map<KeyframeId, Sim3> changes;
  for (const auto& entry : map->keyframes()) {
    changes[entry.first] = inside.count(entry.first) ? alignment.rest_from_segment : Sim3();
  }
  map->apply(changes);
  for (const auto& [pair, match] : alignment.inliers) {
    const TwoViewGeometry& geometry = *graph.edge(pair.first, pair.second);
    KeyframeId first = -1, second = -1;
    for (const EdgeConsistency& edge : segment.cut) {
      if (edge.pair == pair) first = edge.first, second = edge.second;
    }
    const Match& m = geometry.matches[match];
    const LandmarkId of_first = map->keyframe(first)->landmark_of_feature[m.first],
                     of_second = map->keyframe(second)->landmark_of_feature[m.second];
    if (of_first == kNoLandmark || of_second == kNoLandmark || of_first == of_second) continue;
    const bool first_is_inside = inside.count(first) > 0;
    map->merge_landmarks(first_is_inside ? of_first : of_second, first_is_inside ? of_second : of_first);
  }
  return changes;
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
