// The part of the Mapper that compares the whole map with the view graph.

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "cross_view_matcher.h"
#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "mapping/mapper.h"
#include "mapping/retriangulation.h"
#include "motion_prior.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

ViewGraph& Mapper::view_graph() {
  if (!view_graph_) view_graph_.emplace(view_graph_options(options_));
  return *view_graph_;
}

void Mapper::connect(const KeyframePairs& overlapping) {
  ViewGraph& graph = view_graph();
  places_->follow(map_);
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map_);
  std::vector<ViewGraph::Pair> pairs;
  std::map<KeyframeId, int> node;
  for (const Keyframe* keyframe : in_time)
    node[keyframe->id] = graph.add(keyframe->frame_index, keyframe->image);
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    const KeyframeId id = in_time[k]->id;
    for (const std::size_t before : limits_.earlier) {
      if (k >= before) pairs.emplace_back(node.at(id), node.at(in_time[k - before]->id));
    }
    for (const KeyframeId other : neighbors(id, limits_.covisible))
      pairs.emplace_back(node.at(id), node.at(other));
    for (const KeyframeId other : places_->find(in_time[k]->image->set, limits_.similar + 1)) {
      if (node.count(other)) pairs.emplace_back(node.at(id), node.at(other));
    }
  }
  for (const auto& [first, second] : overlapping) pairs.emplace_back(node.at(first), node.at(second));
  graph.connect(pairs);
}

// Restores an earlier state of the map with the same keyframes, if it explains more verified matches of the
// graph.
void Mapper::restore_if_better(Map as_it_was, const GraphConsistencyOptions& consistency) {
  if (compare_explained(map_, as_it_was, view_graph()).p_value() < consistency.significance)
    map_ = std::move(as_it_was);
}

// Replaces the map's landmarks by tracks of the view graph. The map's own landmarks agree with the poses from
// which they were made, right or wrong.
void Mapper::retriangulate(const GraphConsistencyOptions& consistency) {
  Map as_it_was = map_;
  const auto is_masked = [this](KeyframeId id, int feature) { return is_excluded(id, feature); };
  const FeatureTracks tracks =
      graph_tracks(map_, edge_consistency(map_, view_graph(), consistency), view_graph(), is_masked);
  replace_landmarks(tracks, options_.min_inliers, &map_);
  adjust_after_merging();
  restore_if_better(std::move(as_it_was), consistency);
}

namespace {

int unsupported_in(const std::vector<EdgeConsistency>& edges) {
  int unsupported = 0;
  for (const EdgeConsistency& edge : edges) unsupported += edge.matches - edge.supported;
  return unsupported;
}

}  // namespace

std::set<KeyframeId> Mapper::refine_with_graph(const GraphConsistencyOptions& consistency) {
  std::set<KeyframeId> removed;
  int before = std::numeric_limits<int>::max();
  for (int round = 0; round < consistency.max_rounds && !is_cancelled(); ++round) {
    const std::vector<EdgeConsistency> edges = edge_consistency(map_, view_graph(), consistency);
    // Another round must support at least an edge's number of additional matches.
    const int unsupported = unsupported_in(edges);
    if (unsupported > before - consistency.min_inliers) break;
    before = unsupported;
    const std::size_t keyframes = map_.keyframes().size();
    if (correct_segments(inconsistent_segments(map_, edges, consistency), consistency, &removed)) {
      finish();
    } else if (map_.keyframes().size() < keyframes) {
      settle();
    } else {
      break;
    }
  }
  return removed;
}

// Removes these keyframes, unless they are more than half of the map: then something else is wrong, such as
// the calibration.
void Mapper::remove_wrong(const std::set<KeyframeId>& wrong, std::set<KeyframeId>* removed) {
  if (2 * wrong.size() > map_.keyframes().size() + 1) return;
  remove_keyframes(wrong);
  for (const KeyframeId id : wrong) {
    if (!map_.keyframe(id)) removed->insert(id);
  }
}

// Moves segments to where the others' landmarks place them as one. Other segments that these landmarks do not
// confirm are removed, and, where nothing was moved, keyframes far off the motion of the others. Returns
// whether any was moved.
bool Mapper::correct_segments(const std::vector<InconsistentSegment>& segments,
                              const GraphConsistencyOptions& consistency, std::set<KeyframeId>* removed) {
  bool has_moved = false;
  std::set<KeyframeId> wrong;
  for (const InconsistentSegment& segment : segments) {
    const SegmentPlacement place = other_place(map_, view_graph(), segment, consistency);
    if (place.confirms_map(consistency)) continue;
    if (place.is_better(consistency) && place.rest_from_segment) {
      post_correction(move_segment(segment, place, &map_));
      has_moved = true;
    } else {
      wrong.insert(segment.keyframes.begin(), segment.keyframes.end());
    }
  }
  remove_wrong(wrong, removed);
  if (has_moved) {
    adjust_after_merging();
    cull_observations(map_.landmark_ids());
  } else {
    remove_wrong(off_motion(map_, limits_.motion_prior), removed);
  }
  return has_moved;
}

}  // namespace mono_pose_tracker
