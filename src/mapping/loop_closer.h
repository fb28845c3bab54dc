#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <unordered_map>

#include "map/tracking_map.h"
#include "mapping/loop_verifier.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

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
                                                          const std::function<bool()>& cancelled,
                                                          const LoopOptions& options = {});

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
