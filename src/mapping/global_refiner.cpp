// The part of the Mapper that holds the whole map against the view graph.

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "mapping/depth_reversal.h"
#include "mapping/mapper.h"
#include "mapping/remade_landmarks.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

void Mapper::connect(ViewGraph* graph) const {
  constexpr std::array<std::size_t, 3> kBefore = {1, 2, 4};
  constexpr int kCovisible = 4, kPlaces = 3;
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map_);
  std::vector<ViewGraph::Pair> pairs;
  std::map<KeyframeId, int> node;
  for (const Keyframe* keyframe : in_time)
    node[keyframe->id] = graph->add(keyframe->frame_index, keyframe->image);
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    const KeyframeId id = in_time[k]->id;
    for (const std::size_t before : kBefore) {
      if (k >= before) pairs.emplace_back(node.at(id), node.at(in_time[k - before]->id));
    }
    for (const KeyframeId other : neighbors(id, kCovisible)) pairs.emplace_back(node.at(id), node.at(other));
    for (const KeyframeId other : places_->find(in_time[k]->image->set, kPlaces + 1)) {
      if (node.count(other)) pairs.emplace_back(node.at(id), node.at(other));
    }
  }
  graph->connect(pairs);
}

// Goes back to an earlier state of the map, of the same keyframes, that explains more of the graph's verified
// matches.
void Mapper::restore_if_better(Map as_it_was, const ViewGraph& graph,
                               const GraphConsistencyOptions& consistency) {
  if (compare_explained(map_, as_it_was, graph).p_value() < consistency.significance)
    map_ = std::move(as_it_was);
}

// Kept only where the map then explains more of the graph's verified matches.
void Mapper::merge_tracks_of(const ViewGraph& graph, const GraphConsistencyOptions& consistency) {
  Map as_it_was = map_;
  merge_tracks(edge_consistency(map_, graph, consistency), graph, &map_);
  adjust_tied(final_bundle());
  cull_observations(map_.landmark_ids());
  if (compare_explained(as_it_was, map_, graph).p_value() >= consistency.significance)
    map_ = std::move(as_it_was);
}

// Triangulates the landmarks of a narrow view anew from descriptor tracks: a wrong map's own landmarks agree
// with it. Kept unless the map then explains fewer of the graph's verified matches.
void Mapper::retriangulate(const ViewGraph& graph, const GraphConsistencyOptions& consistency) {
  if (!is_narrow(map_)) return;
  Map as_it_was = map_;
  const BundleOptions bundle = final_bundle();
  const auto is_masked = [this](KeyframeId id, int feature) { return is_left_out(id, feature); };
  if (!remake_landmarks(bundle, options_.matching, options_.min_inliers, is_masked, &map_)) return;
  complete(bundle);
  drop_two_view_landmarks();
  restore_if_better(std::move(as_it_was), graph, consistency);
}

namespace {

int unexplained_by(const std::vector<EdgeConsistency>& edges) {
  int unexplained = 0;
  for (const EdgeConsistency& edge : edges) unexplained += edge.matches - edge.explained;
  return unexplained;
}

}  // namespace

// Kept unless the map then explains fewer of the graph's verified matches: the motion prior does not hold
// where a recording was cut.
void Mapper::settle_motion(double least, const ViewGraph& graph, const GraphConsistencyOptions& consistency) {
  if (moves_beyond_belief(map_, least)) {
    Map as_it_was = map_;
    BundleOptions bundle = final_bundle();
    bundle.function_tolerance = kFinalTolerance;
    count(adjust_map_as_it_moved(bundle, &map_));
    restore_if_better(std::move(as_it_was), graph, consistency);
  }
  renew_scale(0);
  publish();
}

std::set<KeyframeId> Mapper::refine_with(ViewGraph* graph, const GraphConsistencyOptions& consistency) {
  constexpr int kMaxRounds = 5;
  std::set<KeyframeId> removed;
  places_->follow(map_);
  connect(graph);
  retriangulate(*graph, consistency);
  merge_tracks_of(*graph, consistency);
  int before = std::numeric_limits<int>::max();
  for (int round = 0; round < kMaxRounds && !is_cancelled(); ++round) {
    places_->follow(map_);
    connect(graph);
    const std::vector<EdgeConsistency> edges = edge_consistency(map_, *graph, consistency);
    // Another round must explain an edge's worth of matches more.
    const int unexplained = unexplained_by(edges);
    if (unexplained > before - consistency.min_inliers) break;
    before = unexplained;
    const std::optional<InconsistentSegment> segment = most_inconsistent_segment(map_, edges);
    if (!segment) break;
    const std::optional<SegmentAlignment> alignment = align_segment(map_, *graph, *segment);
    if (!alignment || !alignment->is_better(consistency)) {
      const std::set<KeyframeId> of_segment(segment->keyframes.begin(), segment->keyframes.end());
      remove_keyframes(of_segment);
      removed.insert(of_segment.begin(), of_segment.end());
      finish();
      continue;
    }
    const KeyframeChanges changes = apply_alignment(*segment, *alignment, *graph, &map_);
    adjust_tied(final_bundle());
    cull_observations(map_.landmark_ids());
    post_correction(changes);
    finish();
  }
  return removed;
}

}  // namespace mono_pose_tracker
