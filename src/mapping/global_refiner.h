#pragma once

#include <set>
#include <vector>

#include "mapping/atlas.h"
#include "mapping/cross_view_matcher.h"
#include "mapping/graph_consistency.h"
#include "mapping/track_extender.h"
#include "mapping/view_graph.h"

namespace mono_pose_tracker {

/// The end of a recording: optimises the atlas's present map by the view graph. Its user publishes the map.
///
///     GlobalRefiner refiner(options, &atlas, &graph);
///     refiner.finish();
///     refiner.refine();
class GlobalRefiner {
 public:
  /// All must outlive this object.
  GlobalRefiner(const MapperOptions& options, Atlas* atlas, ViewGraph* graph)
      : options_(options), atlas_(*atlas), map_(atlas->present().map), graph_(*graph) {}

  /// Adds the edges of the map to the view graph: to earlier keyframes, covisible ones, similar ones, and
  /// overlapping pairs.
  void connect(const KeyframePairs& overlapping = {});
  /// Connects the view graph, merges tracks by its matches, replaces the landmarks by its tracks, completes
  /// these between covisible keyframes, and adjusts the map to convergence.
  void finish();
  /// Compares a finished map with the view graph, in a few rounds. Each moves inconsistent segments to where
  /// the graph places them and finishes the map again, or removes them. Returns the removed keyframes.
  std::set<KeyframeId> refine();
  /// Removes keyframes with wrong poses, and adjusts the map again. Returns the removed ones: none where
  /// they are more than half of the map.
  std::set<KeyframeId> remove(const std::set<KeyframeId>& wrong);

  int failed_adjustments() const { return failed_adjustments_; }

 private:
  TrackExtender extender() const { return {options_, atlas_.present().motions.excluded(), &map_}; }
  BundleOptions bundle(double function_tolerance) const;
  void complete(SimilarKeyframes* similar);
  void adjust_roughly(const BundleOptions& bundle);
  void adjust_after_merging();
  void retriangulate();
  void settle();
  bool correct_segments(const std::vector<InconsistentSegment>& segments, std::set<KeyframeId>* removed);
  void remove_wrong(const std::set<KeyframeId>& wrong, std::set<KeyframeId>* removed);

  const MapperOptions& options_;
  Atlas& atlas_;
  Map& map_;  // the present one
  ViewGraph& graph_;
  int failed_adjustments_ = 0;
};

}  // namespace mono_pose_tracker
