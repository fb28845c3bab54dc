#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "mapping/aliased_places.h"
#include "mapping/pose_support.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Thresholds of loop detection (loop_finder.h), verification and correction (loop_closer.h).
struct LoopOptions {
  AliasedPlaceOptions places;
  double max_drift_of_depth = 0.1;  // share of the points' distance: drift that a rotation on the spot, with
                                    // a path length of zero, may leave
  int max_wait = 3;  // keyframes within which a second must agree; later ones have another view
  double max_disagreement_px = 10;  // at 640 px (image_scale): twice an inlier's error for each of the two
                                    // similarities, which are most accurate near their own points, and the
                                    // drift between the keyframes
  // Common landmarks that connect two keyframes: the default that a pose needs, whatever
  // MapperOptions::min_inliers is. Fewer may be wrong merges, which must not hide a loop.
  int min_covisible = 15;

  // Pose graph.
  int edges = 4;        // from a keyframe to those with most common landmarks. More would make slow parts of
                        // the path too stiff. The first is added for any number of common landmarks and keeps
                        // the graph connected
  int min_shared = 15;  // common landmarks for a further edge: the default that a pose needs. Edges with
                        // fewer are stiffer than their information, whatever resection/min_inliers is
  // Standard deviations between two keyframes of one window, at the order of the drift between windows: a
  // tenth of a degree (rad), a hundredth of scale, a hundredth of the path between them, and the depth times
  // the rotation.
  double rotation_sigma = 0.1 * kDegree;
  double scale_sigma = 0.01;
  double loop_weight = 10;  // of the loop edge against a chain of dozens of edges. The remaining error at the
                            // loop must be below that of an observation, so that landmarks can be merged
};

/// A loop: a keyframe that shows an old place of the map again after drift. The points that it observes are
/// then duplicated in the map, at the old place and at the new side.
struct LoopConstraint {
  KeyframeId from = -1, to = -1;  // the old place, the new keyframe
  Sim3 old_from_new;              // maps a point of the new side to the old side
  Sim3 from_from_to;              // camera of `to` seen from that of `from`: an edge of the pose graph
  std::vector<std::pair<LandmarkId, LandmarkId>> matches;  // (new, old) landmarks to be merged
  PoseSupport support;                                     // of the old landmarks in the new image
  double drift = 0;  // displacement of the new keyframe, as a share of the path between the two
};

/// Locates a keyframe at an old place (keyframe_locator.h), without the landmarks that it observes already,
/// and aligns its own landmarks with those found there (map_joiner.h). Nothing when it is not found, when
/// fewer of its landmarks are found than a pose needs, or when the correction exceeds possible drift
/// (AliasedPlaceOptions::max_drift). An aliased place can pass; LoopFinder handles that.
std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const Map& map, KeyframeId keyframe,
                                          KeyframeId place, const LoopOptions& loops = {});

/// Median error of the other loop's points under this loop's similarity, px in the other's old place.
double loop_disagreement_px(const Map& map, const LoopConstraint& loop, const LoopConstraint& other);

}  // namespace mono_pose_tracker
