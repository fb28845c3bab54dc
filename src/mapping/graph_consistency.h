#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "mapping/view_graph.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct GraphConsistencyOptions {
  double significance = 1e-3;     // of every test here: false alarms a recording; in (0, 1)
  int min_inliers = 25;           // matches of the map's object that an edge needs to count
  double max_landmark_error = 3;  // of a landmark in another image that a match pairs with it, in errors of a
                                  // verified match
  double min_supported = 0.8;     // share of the matches over a cut that poses and landmarks must explain;
                                  // in (0, 1). Right ones usually have 0.9 or more
  double min_explained = 1.0 / 3;  // share of an image's matched features that the map must explain; the
                                   // others match images without a pose alone. At the border of a map right
                                   // ones usually have more than 0.4
  int max_rounds = 5;  // of the global refinement (GlobalRefiner::refine)
};

/// How a map explains an edge of the view graph. Only matches with a landmark on either side count, and of
/// these the motion that most of them obey: independently moving points have no landmarks.
struct EdgeConsistency {
  ViewGraph::Pair pair;
  KeyframeId first = -1, second = -1;
  int motion = 1;     // that most matches of the map's object obey
  int matches = 0;    // verified matches of the map's object
  int explained = 0;  // of these, by the keyframes' poses
  int supported = 0;  // of these, also by the positions of the landmarks
};

/// Edges between keyframes of the map, in the order of the graph.
std::vector<EdgeConsistency> edge_consistency(const Map& map, const ViewGraph& graph,
                                              const GraphConsistencyOptions& options);

/// Keyframes in a row in time that the graph puts elsewhere than the map has them: too few matches over the
/// cut between them and the others are supported.
struct InconsistentSegment {
  std::vector<KeyframeId> keyframes;  // in time; at most half of the map's
  int matches = 0, supported = 0;     // over the cut
  double p_value = 1;                 // of so few, if each were supported with probability min_supported
  std::vector<EdgeConsistency> cut;   // the edges over it
};

/// Disjoint segments, the most inconsistent first: its edges no longer count for the next ones. The p-values
/// are exact binomial tails, significant after Bonferroni over all segments.
std::vector<InconsistentSegment> inconsistent_segments(const Map& map,
                                                       const std::vector<EdgeConsistency>& edges,
                                                       const GraphConsistencyOptions& options);

/// Another place of a segment: moved as one by the similarity of landmarks that matches over its cut pair, or
/// each keyframe registered anew by the landmarks of the others (P3P). Compared with the map by the matches
/// over the cut to landmarks that the other keyframes alone determine.
struct SegmentPlacement {
  std::optional<Sim3> rest_from_segment;                  // none: registered one by one
  std::vector<std::pair<LandmarkId, LandmarkId>> merged;  // landmarks of segment and rest: then the same
  int matches = 0, by_map = 0;                            // compared; of these, explained by the map
  int only_map = 0, only_this = 0;                        // explained by one of the two places alone
  double p_value = 1;  // of so many for this one, were both as good (McNemar's exact test)

  /// It explains significantly more, and most of what contradicts the map: repeated structure has no one
  /// place.
  bool is_better(const GraphConsistencyOptions& options) const {
    return p_value < options.significance && 2 * only_this > matches - by_map;
  }
  /// The other keyframes' landmarks confirm the map's place: what contradicts it is repeated structure.
  bool confirms_map(const GraphConsistencyOptions& options) const {
    return !is_better(options) && 2 * by_map > matches;
  }
};

/// The other place that explains most.
SegmentPlacement other_place(const Map& map, const ViewGraph& graph, const InconsistentSegment& segment,
                             const GraphConsistencyOptions& options);

/// Moves the segment as one, by rest_from_segment. Landmarks that both sides observe are split, and the
/// paired ones merged. Returns how each keyframe of the map moved.
std::map<KeyframeId, Sim3> move_segment(const InconsistentSegment& segment, const SegmentPlacement& place,
                                        Map* map);

/// Images that are elsewhere, by the images that are not in the map: most features of such an image match
/// these alone, and few have a match that the map's poses explain. Repeated structure gives it a place in the
/// map; the images that show the same as it find none there. camera_from_map: poses of the map's images, by
/// frame index.
std::set<std::int64_t> unsupported_images(const ViewGraph& graph,
                                          const std::map<std::int64_t, Rigid3>& camera_from_map,
                                          const GraphConsistencyOptions& options);

/// Two maps of the same keyframes compared by one score: verified matches of the graph that they explain,
/// whether or not the maps ever used them.
struct ExplainedDifference {
  int gained = 0, lost = 0;  // matches that only the new map explains, only the old one
  /// Of so many gained, were both maps as good (McNemar's exact test).
  double p_value() const;
};
ExplainedDifference compare_explained(const Map& before, const Map& after, const ViewGraph& graph);

}  // namespace mono_pose_tracker
