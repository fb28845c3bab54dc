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

/// A loop that was closed, and what it took out.
struct ClosedLoop {
  std::int64_t from_frame = -1, to_frame = -1;  // the old place's keyframe, the new one
  double drift = 0;                             // how far the new one moved, of the way between the two
  double scale_drift = 1;                       // by what lengths at the new one were multiplied
};

/// Where each keyframe goes: new_from_map, that moves also what hangs on it.
using KeyframeChanges = std::map<KeyframeId, Sim3>;

/// Spreads what a loop has drifted by over the way between its ends: a pose graph over similarities, in which
/// keyframes that share most landmarks keep to how they stand to each other. The oldest keyframe stays.
/// Nothing when the solve fails or is cancelled.
std::optional<KeyframeChanges> distribute_loop_correction(const TrackingMap& map, const LoopConstraint& loop,
                                                          const std::function<bool()>& cancelled);

/// The changes of some keyframes, and for all others of the map the change of the keyframe that they share
/// most landmarks with, else of the one before them.
KeyframeChanges extended_to_all(const Map& map, KeyframeChanges changes);

/// Factor by which lengths at each keyframe change; of removed ones, at the keyframe that they hang on.
std::map<KeyframeId, double> scales_of(const Map& map, const KeyframeChanges& changes);

/// What a global bundle adjustment changed in a snapshot, to be applied to the map that has grown since.
class GlobalAdjustment {
 public:
  /// Adjusts all of `tied`, in place; with a wide loss first where parts that were just tied are still apart.
  /// tied: the snapshot, or what it is once some of its landmarks are one, or are seen by further keyframes.
  static std::optional<GlobalAdjustment> solve(const BundleOptions& options, const Map& snapshot,
                                               bool parts_were_apart, Map* merged);

  /// Keyframes and landmarks that have not changed since are where the adjustment has them; the others go
  /// with the keyframe they belong to. Returns the changes of all keyframes.
  KeyframeChanges apply(Map* map) const;

 private:
  struct Moved {
    Eigen::Vector3d before, after;  // x_in_map
  };

  KeyframeChanges changes_;
  std::unordered_map<LandmarkId, Moved> landmarks_;
};

}  // namespace mono_pose_tracker
