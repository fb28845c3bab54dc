#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "map/tracking_map.h"
#include "mapping/aliased_places.h"
#include "mapping/place_index.h"
#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Thresholds of loop detection, verification and correction.
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

/// Locates a keyframe at an old place (locate), without the landmarks that it observes already,
/// and aligns its own landmarks with those found there (map_joiner.h). Nothing when it is not found, when
/// fewer of its landmarks are found than a pose needs, or when the correction exceeds possible drift
/// (AliasedPlaceOptions::max_drift). An aliased place can pass; LoopFinder handles that.
std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const Map& map, KeyframeId keyframe,
                                          KeyframeId place);

/// Median error of the other loop's points under this loop's similarity, px in the other's old place.
double loop_disagreement_px(const Map& map, const LoopConstraint& loop, const LoopConstraint& other);

/// Detects loops: finds old places that look like a new keyframe (place index) and verifies them
/// (verify_loop). A loop is rejected where two places fit equally well, as identical doors do. It needs a
/// second keyframe soon after that finds the same place with the same similarity. Does not correct the map.
/// One thread.
class LoopFinder {
 public:
  explicit LoopFinder(const MapperOptions& options) : options_(options) {}

  /// Called with each new keyframe, in order, unless an earlier loop is still being closed. The index may
  /// hold keyframes that the map no longer has. The `matches` of a returned loop are those on which both
  /// keyframes agree.
  std::optional<LoopConstraint> find(const Map& map, const PlaceIndex& index, KeyframeId keyframe);
  /// A loop that awaits its second keyframe continues to do so.
  void set_options(const MapperOptions& options) { options_ = options; }
  /// Drops the loop that awaits a second keyframe: the map was corrected or another one begun.
  void reset() { awaiting_.reset(); }

 private:
  MapperOptions options_;
  std::optional<LoopConstraint> awaiting_;  // a loop that needs a second keyframe
  int waited_ = 0;                          // keyframes since then
};

/// A closed loop and the drift that it removed.
struct ClosedLoop {
  std::int64_t from_frame = -1, to_frame = -1;  // frame of the old place, of the new keyframe
  double drift = 0;        // displacement of the new one, as a share of the path between the two
  double scale_drift = 1;  // factor of lengths at the new one
};

/// The correction of each keyframe, new_from_map; it also moves what is stored relative to the keyframe.
using KeyframeChanges = std::map<KeyframeId, Sim3>;

/// Distributes the correction of a loop over the path between its ends. Solves a pose graph over
/// similarities, in which keyframes with many common landmarks keep their relative poses. The oldest keyframe
/// stays. Nothing when the solver fails or is cancelled.
std::optional<KeyframeChanges> distribute_loop_correction(const TrackingMap& map, const LoopConstraint& loop,
                                                          const std::function<bool()>& cancelled);

/// Extends the corrections of some keyframes to the whole map. Another keyframe gets the correction of the
/// keyframe with which it shares most landmarks, else of the one before it.
KeyframeChanges extended_to_all(const Map& map, KeyframeChanges changes);

/// The scale change at each keyframe. A removed keyframe has the one of the keyframe to which it is relative.
std::map<KeyframeId, double> scales_of(const Map& map, const KeyframeChanges& changes);

/// The changes that a global bundle adjustment made to a snapshot, to be applied to the map that has grown
/// since.
class GlobalAdjustment {
 public:
  /// Adjusts all of `merged`, in place. Uses a wide loss first where parts that were just merged are still
  /// apart. merged: the snapshot, or the snapshot with merged landmarks and further observations.
  static std::optional<GlobalAdjustment> solve(const BundleOptions& options, const Map& snapshot,
                                               bool parts_were_apart, Map* merged);

  /// Sets keyframes and landmarks that have not changed since to their adjusted values. The others move with
  /// the keyframe they belong to. Returns the corrections of all keyframes.
  KeyframeChanges apply(Map* map) const;

 private:
  struct Moved {
    Eigen::Vector3d before, after;  // x_in_map
  };

  KeyframeChanges changes_;
  std::unordered_map<LandmarkId, Moved> landmarks_;
};

}  // namespace mono_pose_tracker
