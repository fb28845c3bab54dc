#pragma once

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
  double min_supported = 0.8;     // share of the matches of a keyframe that poses and landmarks must explain;
                                  // in (0, 1). Right ones usually have 0.9 or more
};

/// How a map explains an edge of the view graph. Only matches with a landmark on either side count, and of
/// these the motion that most of them obey: independently moving points have no landmarks.
struct EdgeConsistency {
  ViewGraph::Pair pair;
  KeyframeId first = -1, second = -1;
  int motion = 1;      // that most matches of the map's object obey
  int matches = 0;     // verified matches of the map's object
  int explained = 0;   // of these, by the keyframes' poses
  int supported = 0;   // of these, also by the positions of the landmarks
  double p_value = 1;  // of so few, if each were explained with probability 1/2 (exact binomial tail)
  bool is_inconsistent = false;  // after Benjamini and Hochberg (1995) over all edges
};

/// Edges between keyframes of the map, in the order of the graph.
std::vector<EdgeConsistency> edge_consistency(const Map& map, const ViewGraph& graph,
                                              const GraphConsistencyOptions& options);

/// Keyframes whose pose the graph contradicts: those with a share of supported matches below min_supported.
/// The worst is taken first, and its edges no longer count for the others.
std::set<KeyframeId> contradicted_keyframes(const std::vector<EdgeConsistency>& edges,
                                            const GraphConsistencyOptions& options);

/// Keyframes in a row in time that the graph puts elsewhere than the map has them: over the cut between them
/// and the others, inconsistent edges hold more verified matches than the map explains.
struct InconsistentSegment {
  std::vector<KeyframeId> keyframes;  // in time; at most half of the map's
  int contradicting = 0;              // matches of inconsistent edges over the cut, not explained
  int explained = 0;                  // matches over the cut that the map explains
  std::vector<EdgeConsistency> cut;   // the edges over it
};

/// The segment whose cut has the largest surplus of contradicting matches; none where no cut has any.
std::optional<InconsistentSegment> most_inconsistent_segment(const Map& map,
                                                             const std::vector<EdgeConsistency>& edges);

/// Another place of a segment, from landmarks that verified matches over its cut pair.
struct SegmentAlignment {
  Sim3 rest_from_segment;
  std::vector<std::pair<ViewGraph::Pair, int>> inliers;  // edge and match that agree with it
  int only_map = 0, only_this = 0;  // matches over the cut that one of the two places alone explains
  double p_value = 1;               // of so many for this one, were both as good (McNemar's exact test)

  bool is_better(const GraphConsistencyOptions& options) const { return p_value < options.significance; }
};

/// None where the pairs do not determine a similarity.
std::optional<SegmentAlignment> align_segment(const Map& map, const ViewGraph& graph,
                                              const InconsistentSegment& segment);

/// Moves the segment's keyframes; landmarks that both sides observe are split, and those that the alignment's
/// inliers pair become one. Returns how each keyframe of the map moved.
std::map<KeyframeId, Sim3> apply_alignment(const InconsistentSegment& segment,
                                           const SegmentAlignment& alignment, const ViewGraph& graph,
                                           Map* map);

/// Two maps of the same keyframes compared by one score: verified matches of the graph that they explain,
/// whether or not the maps ever used them.
struct ExplainedDifference {
  int gained = 0, lost = 0;  // matches that only the new map explains, only the old one
  /// Of so many gained, were both maps as good (McNemar's exact test).
  double p_value() const;
};
ExplainedDifference compare_explained(const Map& before, const Map& after, const ViewGraph& graph);

/// P(X >= k) of a binomial distribution of n trials; exact.
double binomial_tail(int k, int n, double probability);

/// The largest p-value that is significant at the false discovery rate (Benjamini and Hochberg 1995); 0:
/// none.
double significant_p_value(std::vector<double> p_values, double false_discovery_rate);

}  // namespace mono_pose_tracker
