#include "mapping/loop_closer.h"

#include <algorithm>
#include <limits>
#include <set>
#include <unordered_set>

#include "common/statistics.h"
#include "common/threads.h"
#include "keyframe_landmarks.h"
#include "mapping/landmark_pose.h"
#include "mapping/map_joiner.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "optimization/map_adjustment.h"
#include "optimization/pose_graph.h"

namespace mono_pose_tracker {

namespace {

constexpr LoopOptions kLoops{};

double median_depth(const TrackingMap& map, const KeyframeView& keyframe) {
  std::vector<double> depths;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    const auto landmark = map.landmarks.find(l);
    if (landmark != map.landmarks.end())
      depths.push_back((keyframe.camera_from_map * landmark->second).norm());
  }
  return median(std::move(depths));
}

PoseGraphEdge make_edge(int from, int to, const Sim3& measured, double depth, double weight) {
  PoseGraphEdge edge;
  edge.from = from;
  edge.to = to;
  edge.measured = measured;
  const double shift_sigma = kLoops.scale_sigma * measured.translation.norm() + kLoops.rotation_sigma * depth;
  edge.turn_weight = weight / kLoops.rotation_sigma;
  edge.shift_weight = weight / std::max(shift_sigma, 1e-9);
  edge.scale_weight = weight / kLoops.scale_sigma;
  return edge;
}

// Pairs of strongly covisible keyframes, the older first.
std::set<std::pair<KeyframeId, KeyframeId>> strongly_covisible_pairs(const TrackingMap& map) {
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes) {
    int edges = 0;
    for (std::size_t i = 0; i < keyframe.covisible.size() && edges < kLoops.edges; ++i) {
      const KeyframeId other = keyframe.covisible[i];
      if (edges > 0 && keyframe.shared_landmarks[i] < kLoops.min_shared) break;
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
                                                          const std::function<bool()>& cancelled) {
  PoseGraph graph;
  std::map<KeyframeId, int> node_of;
  for (const auto& [id, keyframe] : map.keyframes) {
    node_of[id] = static_cast<int>(graph.nodes.size());
    graph.nodes.push_back({Sim3(keyframe.camera_from_map.inverse()), graph.nodes.empty()});
  }
  for (const auto& [a, b] : strongly_covisible_pairs(map)) {
    const KeyframeView &from = map.keyframes.at(a), &to = map.keyframes.at(b);
    graph.edges.push_back(make_edge(node_of.at(a), node_of.at(b),
                                    Sim3(from.camera_from_map * to.camera_from_map.inverse()),
                                    median_depth(map, from), 1));
  }
  graph.edges.push_back(make_edge(node_of.at(loop.from), node_of.at(loop.to), loop.from_from_to,
                                  median_depth(map, map.keyframes.at(loop.from)), kLoops.loop_weight));
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

namespace {

// Keyframes of the map that are connected to this one.
std::vector<KeyframeId> connected_to(const Map& map, KeyframeId keyframe) {
  std::vector<KeyframeId> connected;
  for (const auto& [id, shared] : map.covisible(keyframe)) {
    if (shared < kLoops.min_covisible) break;
    connected.push_back(id);
  }
  return connected;
}

/// The keyframe and those connected to it directly or by one between: bundle adjustment corrects the drift
/// among them.
std::unordered_set<KeyframeId> near_in_map(const Map& map, KeyframeId keyframe) {
  std::unordered_set<KeyframeId> near = {keyframe};
  for (const KeyframeId id : connected_to(map, keyframe)) {
    near.insert(id);
    const std::vector<KeyframeId> next = connected_to(map, id);
    near.insert(next.begin(), next.end());
  }
  return near;
}

bool is_covisible(const Map& map, KeyframeId a, KeyframeId b) { return a == b || map.shared(a, b) > 0; }

// Whether features that both loops match are mostly matched to points that the old place observes elsewhere:
// similar structures, however close together.
bool contradict(const Map& map, const LoopConstraint& first, const LoopConstraint& second) {
  const Keyframe& place = *map.keyframe(first.from);
  const auto pixel_of = [&](LandmarkId id, Eigen::Vector2d* pixel) {
    const Landmark* landmark = map.landmark(id);
    return landmark && place.image->camera.project(place.camera_from_map * landmark->x_in_map, pixel);
  };
  const std::unordered_map<LandmarkId, LandmarkId> old_of(first.matches.begin(), first.matches.end());
  const double limit = kLoops.max_disagreement_px * image_scale(place.image->camera);
  int both = 0, apart = 0;
  for (const auto& [in_new, in_old] : second.matches) {
    const auto other = old_of.find(in_new);
    if (other == old_of.end()) continue;
    ++both;
    Eigen::Vector2d a, b;
    if (!pixel_of(other->second, &a)) continue;
    apart += !pixel_of(in_old, &b) || (a - b).norm() > limit;
  }
  return 2 * apart > both;
}

std::vector<KeyframeId> places_to_verify(const Map& map, const PlaceIndex& index, KeyframeId keyframe) {
  const std::unordered_set<KeyframeId> near = near_in_map(map, keyframe);
  std::vector<KeyframeId> ids;
  for (const PlaceMatch& match :
       index.query(map.keyframe(keyframe)->image->set, kBestPlaces,
                   [&](KeyframeId id) { return map.keyframe(id) && near.count(id) == 0; })) {
    ids.push_back(match.id);
  }
  return ids;
}

// Whether each loop moves the other's points to where the other's old place observes them.
bool agree(const Map& map, const LoopConstraint& first, const LoopConstraint& second) {
  const auto explains = [&](const LoopConstraint& loop, const LoopConstraint& other) {
    const Keyframe* place = map.keyframe(other.from);
    return place && loop_disagreement_px(map, loop, other) <
                        kLoops.max_disagreement_px * image_scale(place->image->camera);
  };
  return explains(first, second) && explains(second, first);
}

std::optional<LoopConstraint> best_unambiguous(const Map& map, std::vector<LoopConstraint> loops) {
  if (loops.empty()) return std::nullopt;
  std::stable_sort(loops.begin(), loops.end(), [](const LoopConstraint& a, const LoopConstraint& b) {
    return a.support.found > b.support.found;
  });
  for (std::size_t i = 1; i < loops.size(); ++i) {
    if (loops[i].support.found <= kLoops.places.aliased_share * loops[0].support.found) continue;
    // Covisible keyframes are one place when their loops agree in the image: their similarities may differ
    // where the depths constrain the scale weakly. Those of two doors in a row do not agree.
    const bool is_ambiguous = is_covisible(map, loops[0].from, loops[i].from)
                                  ? contradict(map, loops[0], loops[i])
                                  : !agree(map, loops[0], loops[i]);
    if (is_ambiguous) return std::nullopt;
  }
  return std::move(loops[0]);
}

}  // namespace

std::optional<LoopConstraint> LoopFinder::find(const Map& map, const PlaceIndex& index, KeyframeId keyframe) {
  if (awaiting_ && ++waited_ > kLoops.max_wait) awaiting_.reset();
  std::vector<LoopConstraint> loops;
  const std::vector<KeyframeId> places = places_to_verify(map, index, keyframe);
  std::vector<std::optional<LoopConstraint>> verified(places.size());
  parallel_for(static_cast<int>(places.size()), options_.threads,
               [&](int i) { verified[i] = verify_loop(options_, map, keyframe, places[i]); });
  for (std::optional<LoopConstraint>& loop : verified) {
    if (loop) loops.push_back(std::move(*loop));
  }
  const bool any = !loops.empty();
  std::optional<LoopConstraint> loop = best_unambiguous(map, std::move(loops));
  if (!loop) {
    // Several places are similar: the loop of a neighbour was one of them by chance.
    if (any) awaiting_.reset();
    return std::nullopt;
  }
  if (awaiting_ && is_covisible(map, awaiting_->from, loop->from) && agree(map, *awaiting_, *loop)) {
    loop->matches.insert(loop->matches.end(), awaiting_->matches.begin(), awaiting_->matches.end());
    loop->matches = sorted_unique(std::move(loop->matches));
    awaiting_.reset();
    return loop;
  }
  awaiting_ = std::move(loop);
  waited_ = 0;
  return std::nullopt;
}

namespace {

// Drift as a share of the path between the two keyframes; nothing when it exceeds the limit.
std::optional<double> drift_of(const Map& map, const Keyframe& keyframe, const LoopConstraint& loop) {
  if (loop.old_from_new.rotation.angularDistance(Eigen::Quaterniond::Identity()) >
      kLoops.places.max_rotation_drift)
    return std::nullopt;
  const Eigen::Vector3d center = keyframe.center_in_map();
  std::vector<double> distances;
  for (const auto& match : loop.matches)
    distances.push_back((map.landmark(match.first)->x_in_map - center).norm());
  const double path_length = path_length_between(map.keyframes(), *map.keyframe(loop.from), keyframe);
  const double moved = (loop.old_from_new * center - center).norm();
  if (moved >
      kLoops.places.max_drift * path_length + kLoops.max_drift_of_depth * median(std::move(distances)))
    return std::nullopt;
  return path_length > 0 ? moved / path_length : 0;
}

}  // namespace

std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const Map& map,
                                          KeyframeId keyframe_id, KeyframeId place) {
  const Keyframe& keyframe = *map.keyframe(keyframe_id);
  const std::unordered_set<LandmarkId> own(keyframe.landmark_of_feature.begin(),
                                           keyframe.landmark_of_feature.end());
  const Location location = locate(options, map, place, *keyframe.image, own);
  if (!location.found) return std::nullopt;
  const std::optional<MapAlignment> alignment =
      align_maps(options, map, map, {{keyframe_id, {location.matches.begin(), location.matches.end()}}});
  if (!alignment) return std::nullopt;
  LoopConstraint loop;
  loop.from = place;
  loop.to = keyframe_id;
  loop.old_from_new = alignment->other_from_map;
  loop.from_from_to = Sim3(map.keyframe(place)->camera_from_map) * loop.old_from_new *
                      Sim3(keyframe.camera_from_map.inverse());
  loop.matches = same_landmarks(map, alignment->found);
  // A landmark has as many rays as keyframes observe it: these count as one.
  if (static_cast<int>(loop.matches.size()) < options.min_inliers) return std::nullopt;
  loop.support = location.support;
  const std::optional<double> drift = drift_of(map, keyframe, loop);
  if (!drift) return std::nullopt;
  loop.drift = *drift;
  return loop;
}

double loop_disagreement_px(const Map& map, const LoopConstraint& loop, const LoopConstraint& other) {
  const Keyframe* place = map.keyframe(other.from);
  if (!place) return std::numeric_limits<double>::infinity();
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> x_in_camera;
  for (const auto& [in_new, in_old] : other.matches) {
    const Landmark *of_new = map.landmark(in_new), *of_old = map.landmark(in_old);
    if (!of_new || !of_old) continue;
    x_in_camera.emplace_back(place->camera_from_map * of_old->x_in_map,
                             place->camera_from_map * (loop.old_from_new * of_new->x_in_map));
  }
  return disagreement_px(place->image->camera, x_in_camera);
}

}  // namespace mono_pose_tracker
