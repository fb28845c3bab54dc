#include "mapping/global_refiner.h"

#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include "keyframe_landmarks.h"
#include "mapping/mapper_limits.h"
#include "mapping/retriangulation.h"
#include "motion_prior.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

constexpr GraphConsistencyOptions kConsistency{};

int unsupported_in(const std::vector<EdgeConsistency>& edges) {
  int unsupported = 0;
  for (const EdgeConsistency& edge : edges) unsupported += edge.matches - edge.supported;
  return unsupported;
}

// Two views cannot be inconsistent along the epipolar line: landmarks without a third view are dropped from
// the result, unless the map has hardly more views.
void drop_two_view_landmarks(Map* map) {
  if (map->keyframes().size() <= 3) return;
  for (const LandmarkId l : map->landmark_ids()) {
    if (map->landmark(l)->observations.size() == 2) map->remove_landmark(l);
  }
}

}  // namespace

void GlobalRefiner::connect(const KeyframePairs& overlapping) {
  KeyframePlaces& places = *atlas_.present().places;
  places.follow(map_);
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map_);
  std::vector<ViewGraph::Pair> pairs;
  std::map<KeyframeId, int> node;
  for (const Keyframe* keyframe : in_time)
    node[keyframe->id] = graph_.add(keyframe->frame_index, keyframe->image);
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    const KeyframeId id = in_time[k]->id;
    for (const std::size_t before : kMapperLimits.earlier) {
      if (k >= before) pairs.emplace_back(node.at(id), node.at(in_time[k - before]->id));
    }
    for (const KeyframeId other : neighbors(map_, id, kMapperLimits.covisible))
      pairs.emplace_back(node.at(id), node.at(other));
    for (const KeyframeId other : places.find(in_time[k]->image->set, kMapperLimits.similar + 1)) {
      if (node.count(other)) pairs.emplace_back(node.at(id), node.at(other));
    }
  }
  for (const auto& [first, second] : overlapping) pairs.emplace_back(node.at(first), node.at(second));
  graph_.connect(pairs);
}

void GlobalRefiner::finish() {
  // Flags of static overlay are lost when maps are merged or switched.
  for (const auto& entry : map_.keyframes())
    atlas_.present().motions.exclude_static_overlay(options_, entry.first, &map_);
  // All shared tracks are kept, unlike in a growing map, and inconsistent ones are culled below. Dropping
  // them cost a recording with many gaps a tenth of its images.
  const KeyframePairs overlapping = overlapping_pairs(options_.bundle, map_);
  connect(overlapping);
  if (!match_across_views(options_, overlapping, &graph_, &map_).empty()) adjust_after_merging();
  retriangulate();
  // Twice: better poses give more matches, and outliers found by the first adjustment must not bias the
  // second.
  SimilarKeyframes similar;
  complete(&similar);
  adjust_roughly(bundle(kMapperLimits.rough_tolerance));
  extender().cull(map_.landmark_ids());
  complete(&similar);
  settle();
}

// Extends all tracks and creates landmarks between covisible keyframes.
void GlobalRefiner::complete(SimilarKeyframes* similar) {
  for (const auto& entry : map_.keyframes()) {
    const KeyframeId id = entry.first;
    const std::vector<KeyframeId> near = neighbors(map_, id, 2 * options_.mapping.matching_keyframes);
    extender().extend(
        id, extender().within_reach(id, kMapperLimits.large_map, *atlas_.present().places, similar));
    extender().create_landmarks(id, near);
  }
}

BundleOptions GlobalRefiner::bundle(double function_tolerance) const {
  BundleOptions bundle = options_.bundle;
  bundle.max_iterations = kMapperLimits.final_iterations;
  bundle.function_tolerance = function_tolerance;
  return bundle;
}

// Adjusts the whole map, its poses by some of the landmarks.
void GlobalRefiner::adjust_roughly(const BundleOptions& bundle) {
  std::vector<KeyframeId> all;
  for (const auto& entry : map_.keyframes()) all.push_back(entry.first);
  failed_adjustments_ += adjust_keyframes(bundle, all, 0, kMapperLimits.rough_landmarks, &map_).failed;
}

// Adjusts with a wide loss first, so that merged tracks have an effect before anything is culled.
void GlobalRefiner::adjust_after_merging() {
  const BundleOptions usual = bundle(options_.bundle.function_tolerance);
  for (const BundleOptions& pass : {with_wide_loss(usual), usual}) adjust_roughly(pass);
}

// Replaces the map's landmarks by tracks of the view graph. The map's own landmarks agree with the poses from
// which they were made, right or wrong. They return where they explain more verified matches of the graph.
void GlobalRefiner::retriangulate() {
  Map as_it_was = map_;
  const FlaggedFeatures& excluded = atlas_.present().motions.excluded();
  const auto is_excluded = [&](KeyframeId id, int feature) { return is_flagged(excluded, id, feature); };
  const FeatureTracks tracks =
      graph_tracks(map_, edge_consistency(map_, graph_, kConsistency), graph_, is_excluded);
  replace_landmarks(tracks, options_.min_inliers, &map_);
  adjust_after_merging();
  if (compare_explained(map_, as_it_was, graph_).p_value() < kConsistency.significance)
    map_ = std::move(as_it_was);
}

// Adjusts the whole map to convergence.
void GlobalRefiner::settle() {
  failed_adjustments_ += adjust_map(bundle(kMapperLimits.final_tolerance), &map_).failed;
  extender().cull(map_.landmark_ids());
  drop_two_view_landmarks(&map_);
  atlas_.renew_unit(options_.scale, 0);
}

std::set<KeyframeId> GlobalRefiner::refine() {
  std::set<KeyframeId> removed;
  int before = std::numeric_limits<int>::max();
  for (int round = 0; round < kConsistency.max_rounds && !options_.bundle.is_cancelled(); ++round) {
    const std::vector<EdgeConsistency> edges = edge_consistency(map_, graph_, kConsistency);
    // Another round must support at least an edge's number of additional matches.
    const int unsupported = unsupported_in(edges);
    if (unsupported > before - kConsistency.min_inliers) break;
    before = unsupported;
    const std::size_t keyframes = map_.keyframes().size();
    if (correct_segments(inconsistent_segments(map_, edges, kConsistency), &removed)) {
      finish();
    } else if (map_.keyframes().size() < keyframes) {
      settle();
    } else {
      break;
    }
  }
  return removed;
}

std::set<KeyframeId> GlobalRefiner::remove(const std::set<KeyframeId>& wrong) {
  std::set<KeyframeId> removed;
  remove_wrong(wrong, &removed);
  if (!removed.empty()) settle();
  return removed;
}

// Moves segments to where the others' landmarks place them as one. Other segments that these landmarks do not
// confirm are removed, and, where nothing was moved, keyframes far off the motion of the others. Returns
// whether any was moved.
bool GlobalRefiner::correct_segments(const std::vector<InconsistentSegment>& segments,
                                     std::set<KeyframeId>* removed) {
  bool has_moved = false;
  std::set<KeyframeId> wrong;
  for (const InconsistentSegment& segment : segments) {
    const SegmentPlacement place = other_place(map_, graph_, segment, kConsistency);
    if (place.confirms_map(kConsistency)) continue;
    if (place.is_better(kConsistency) && place.rest_from_segment) {
      atlas_.add_correction(move_segment(segment, place, &map_));
      has_moved = true;
    } else {
      wrong.insert(segment.keyframes.begin(), segment.keyframes.end());
    }
  }
  remove_wrong(wrong, removed);
  if (has_moved) {
    adjust_after_merging();
    extender().cull(map_.landmark_ids());
  } else {
    remove_wrong(off_motion(map_), removed);
  }
  return has_moved;
}

// Removes these keyframes, unless they are more than half of the map: then something else is wrong, such as
// the calibration.
void GlobalRefiner::remove_wrong(const std::set<KeyframeId>& wrong, std::set<KeyframeId>* removed) {
  if (2 * wrong.size() > map_.keyframes().size() + 1) return;
  atlas_.remove_keyframes(wrong, options_);
  for (const KeyframeId id : wrong) {
    if (!map_.keyframe(id)) removed->insert(id);
  }
}

}  // namespace mono_pose_tracker
