#include "mapping/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "optimization/map_adjustment.h"
#include "optimization/pose_graph.h"

namespace mono_pose_tracker {

namespace {

double median_depth(const TrackingMap& map, const KeyframeView& keyframe) {
  std::vector<double> depths;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    const auto landmark = map.landmarks.find(l);
    if (landmark != map.landmarks.end())
      depths.push_back((keyframe.camera_from_map * landmark->second).norm());
  }
  return median(std::move(depths));
}

PoseGraphEdge make_edge(int from, int to, const Sim3& measured, double depth, double weight,
                        const LoopOptions& options) {
  PoseGraphEdge edge;
  edge.from = from;
  edge.to = to;
  edge.measured = measured;
  const double shift_sigma =
      options.scale_sigma * measured.translation.norm() + options.rotation_sigma * depth;
  edge.turn_weight = weight / options.rotation_sigma;
  edge.shift_weight = weight / std::max(shift_sigma, 1e-9);
  edge.scale_weight = weight / options.scale_sigma;
  return edge;
}

// Pairs of strongly covisible keyframes, the older first.
std::set<std::pair<KeyframeId, KeyframeId>> strongly_covisible_pairs(const TrackingMap& map,
                                                                     const LoopOptions& options) {
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes) {
    int edges = 0;
    for (std::size_t i = 0; i < keyframe.covisible.size() && edges < options.edges; ++i) {
      const KeyframeId other = keyframe.covisible[i];
      if (edges > 0 && keyframe.shared_landmarks[i] < options.min_shared) break;
      if (map.keyframes.count(other) == 0) continue;
      pairs.insert(std::minmax(id, other));
      ++edges;
    }
  }
  return pairs;
}

Sim3 change_of(const Rigid3& camera_from_map, const Sim3& new_from_camera) {
  return new_from_camera * Sim3(camera_from_map);
}

}  // namespace

std::optional<KeyframeChanges> distribute_loop_correction(const TrackingMap& map, const LoopConstraint& loop,
                                                          const std::function<bool()>& cancelled,
                                                          const LoopOptions& options) {
  PoseGraph graph;
  std::map<KeyframeId, int> node_of;
  for (const auto& [id, keyframe] : map.keyframes) {
    node_of[id] = static_cast<int>(graph.nodes.size());
    graph.nodes.push_back({Sim3(keyframe.camera_from_map.inverse()), graph.nodes.empty()});
  }
  for (const auto& [a, b] : strongly_covisible_pairs(map, options)) {
    const KeyframeView &from = map.keyframes.at(a), &to = map.keyframes.at(b);
    graph.edges.push_back(make_edge(node_of.at(a), node_of.at(b),
                                    Sim3(from.camera_from_map * to.camera_from_map.inverse()),
                                    median_depth(map, from), 1, options));
  }
  graph.edges.push_back(make_edge(node_of.at(loop.from), node_of.at(loop.to), loop.from_from_to,
                                  median_depth(map, map.keyframes.at(loop.from)), options.loop_weight,
                                  options));
  PoseGraphOptions solver;
  solver.cancel = cancelled;
  const PoseGraphReport report = adjust_pose_graph(solver, &graph);
  if (!report.usable || report.cancelled) return std::nullopt;
  KeyframeChanges changes;
  for (const auto& [id, node] : node_of) {
    changes[id] = change_of(map.keyframes.at(id).camera_from_map, graph.nodes[node].map_from_node);
  }
  return changes;
}

KeyframeChanges extended_to_all(const Map& map, KeyframeChanges changes) {
  const KeyframeChanges known = changes;
  if (known.empty()) return changes;
  for (const auto& entry : map.keyframes()) {
    const KeyframeId id = entry.first;
    if (known.count(id)) continue;
    const auto covisible = map.covisible(id);
    const auto nearest = std::find_if(covisible.begin(), covisible.end(),
                                      [&](const auto& other) { return known.count(other.first) > 0; });
    if (nearest != covisible.end()) {
      changes[id] = known.at(nearest->first);
    } else {
      const auto after = known.upper_bound(id);
      changes[id] = after == known.begin() ? after->second : std::prev(after)->second;
    }
  }
  return changes;
}

std::map<KeyframeId, double> scales_of(const Map& map, const KeyframeChanges& changes) {
  std::map<KeyframeId, double> scales;
  for (const auto& [id, change] : changes) scales[id] = change.scale;
  for (const auto& [id, link] : map.removed_keyframes()) {
    const auto found = changes.find(living_ancestor(map.removed_keyframes(), id));
    if (found != changes.end()) scales[id] = found->second.scale;
  }
  return scales;
}

std::optional<GlobalAdjustment> GlobalAdjustment::solve(const BundleOptions& options, const Map& snapshot,
                                                        bool parts_were_apart, Map* merged) {
  std::vector<BundleOptions> passes = {options};
  if (parts_were_apart) passes.insert(passes.begin(), with_wide_loss(options));
  for (const BundleOptions& bundle : passes) {
    const BundleReport report = adjust_map(bundle, merged);
    if (!report.usable || report.cancelled) return std::nullopt;
  }
  GlobalAdjustment result;
  for (const auto& [id, landmark] : snapshot.landmarks()) {
    const Landmark* adjusted = merged->landmark(id);
    if (adjusted) result.landmarks_[id] = {landmark.x_in_map, adjusted->x_in_map};
  }
  for (const auto& [id, keyframe] : snapshot.keyframes()) {
    const Keyframe& adjusted = *merged->keyframe(id);
    const Rigid3& now = adjusted.camera_from_map;
    std::vector<double> growth;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      // The feature may observe another landmark since, at another position.
      const LandmarkId first = keyframe.landmark_of_feature[f], then = adjusted.landmark_of_feature[f];
      if (first == kNoLandmark || then == kNoLandmark) continue;
      const double before = (keyframe.camera_from_map * snapshot.landmark(first)->x_in_map).norm();
      if (before > 0) growth.push_back((now * merged->landmark(then)->x_in_map).norm() / before);
    }
    Sim3 new_from_camera(now.inverse());
    if (!growth.empty()) new_from_camera.scale = median(std::move(growth));
    result.changes_[id] = change_of(keyframe.camera_from_map, new_from_camera);
  }
  return result;
}

KeyframeChanges GlobalAdjustment::apply(Map* map) const {
  std::vector<LandmarkId> unchanged;
  for (const LandmarkId id : map->landmark_ids()) {
    const auto known = landmarks_.find(id);
    if (known != landmarks_.end() && known->second.before == map->landmark(id)->x_in_map) {
      unchanged.push_back(id);
    }
  }
  KeyframeChanges changes = extended_to_all(*map, changes_);
  map->apply(changes);
  for (const LandmarkId id : unchanged) map->set_position(id, landmarks_.at(id).after);
  return changes;
}

}  // namespace mono_pose_tracker
