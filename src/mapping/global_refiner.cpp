// The part of the Mapper that holds the whole map against the view graph.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "mono_pose_tracker/mapping/mapper.h"
#include "mono_pose_tracker/optimization/map_adjustment.h"

namespace mono_pose_tracker {

void Mapper::connect(ViewGraph* graph) const {
  constexpr std::array<std::size_t, 3> kBefore = {1, 2, 4};
  constexpr int kCovisible = 4, kPlaces = 3;
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map_);
  std::vector<ViewGraph::Pair> pairs;
  std::map<KeyframeId, int> node;
  for (const Keyframe* keyframe : in_time) node[keyframe->id] = graph->add(keyframe->frame_index, keyframe->image);
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

std::set<KeyframeId> Mapper::refine_with(ViewGraph* graph, const GraphConsistencyOptions& consistency) {
  constexpr int kMaxRounds = 5;
  std::set<KeyframeId> removed;
  const bool debug = std::getenv("MPT_DEBUG");
  for (int round = 0; round < kMaxRounds && !is_cancelled(); ++round) {
    places_->follow(map_);
    connect(graph);
    const std::vector<EdgeConsistency> edges = edge_consistency(map_, *graph, consistency);
    const std::optional<InconsistentSegment> segment = most_inconsistent_segment(map_, edges);
    if (debug) {
      int bad = 0;
      for (const auto& e : edges) {
        bad += e.is_inconsistent;
        if (e.is_inconsistent)
          std::fprintf(stderr, "  edge %ld-%ld %d of %d %s\n", map_.keyframe(e.first)->frame_index,
                       map_.keyframe(e.second)->frame_index, e.explained, e.matches,
                       to_string(graph->edge(e.pair.first, e.pair.second)->type));
      }
      std::fprintf(stderr, "round %d: %zu keyframes %zu edges (graph %zu), %d inconsistent\n", round,
                   map_.keyframes().size(), edges.size(), graph->edges().size(), bad);
      if (segment)
        std::fprintf(stderr, "  segment of %zu keyframes %ld..%ld: contradicting %d explained %d\n",
                     segment->keyframes.size(), map_.keyframe(segment->keyframes.front())->frame_index,
                     map_.keyframe(segment->keyframes.back())->frame_index, segment->contradicting,
                     segment->explained);
    }
    if (!segment) break;
    const std::optional<SegmentAlignment> alignment = align_segment(map_, *graph, *segment);
    if (debug && alignment)
      std::fprintf(stderr, "  alignment: scale %g angle %g t %g inliers %zu only_map %d only_this %d p %g\n",
                   alignment->rest_from_segment.scale,
                   57.3 * alignment->rest_from_segment.rotation.angularDistance(Eigen::Quaterniond::Identity()),
                   alignment->rest_from_segment.translation.norm(), alignment->inliers.size(),
                   alignment->only_map, alignment->only_this, alignment->p_value);
    if (!alignment || !alignment->is_better(consistency)) {
      const std::set<KeyframeId> of_segment(segment->keyframes.begin(), segment->keyframes.end());
      remove_keyframes(of_segment);
      removed.insert(of_segment.begin(), of_segment.end());
      finish();
      continue;
    }
    BundleOptions bundle = options_.bundle;
    bundle.max_iterations = kFinalIterations;
    const KeyframeChanges changes = apply_alignment(*segment, *alignment, *graph, &map_);
    adjust_tied(bundle);
    cull_observations(map_.landmark_ids());
    post_correction(changes);
    finish();
  }
  return removed;
}

}  // namespace mono_pose_tracker
