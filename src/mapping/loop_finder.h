#pragma once

#include <optional>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/loop_verifier.h"
#include "mapping/place_index.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Notices that the camera is back where it was: old places that look like a new keyframe (place index),
/// compared with it (loop_verifier.h). Nothing is believed that two places say equally well, as identical
/// doors do, nor what one keyframe says alone: one of the next must find the same place, and the same
/// similarity. Corrects nothing itself. One thread.
class LoopFinder {
 public:
  LoopFinder(const MapperOptions& options, const CameraModel& camera) : options_(options), camera_(camera) {}

  /// Called with each new keyframe, in order, unless a loop found earlier is still being closed. The index
  /// may hold keyframes that the map has no more. Of a loop returned, `matches` are those of both keyframes
  /// that agree.
  std::optional<LoopConstraint> find(const TrackingMap& map, const PlaceIndex& index, KeyframeId keyframe);
  /// What awaits a second keyframe goes on to do so.
  void set_options(const MapperOptions& options) { options_ = options; }
  /// Forgets what awaits a second keyframe: the map was corrected or another one begun.
  void reset() { awaiting_.reset(); }

 private:
  std::vector<KeyframeId> candidates(const TrackingMap& map, const PlaceIndex& index,
                                     KeyframeId keyframe) const;
  std::optional<LoopConstraint> best_unambiguous(const TrackingMap& map,
                                                 std::vector<LoopConstraint> loops) const;
  bool agree(const TrackingMap& map, const LoopConstraint& first, const LoopConstraint& second) const;

  MapperOptions options_;
  CameraModel camera_;
  std::optional<LoopConstraint> awaiting_;  // a second keyframe that says the same
  int waited_ = 0;                          // keyframes since
};

}  // namespace mono_pose_tracker
