#pragma once

#include <optional>
#include <vector>

#include "mapping/loop_verifier.h"
#include "mapping/place_index.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Detects loops: finds old places that look like a new keyframe (place index) and verifies them
/// (loop_verifier.h). A loop is rejected where two places fit equally well, as identical doors do. It needs a
/// second keyframe soon after that finds the same place with the same similarity. Does not correct the map.
/// One thread.
class LoopFinder {
 public:
  LoopFinder(const MapperOptions& options, const CameraModel& camera, const LoopOptions& loops = {})
      : options_(options), camera_(camera), loops_(loops) {}

  /// Called with each new keyframe, in order, unless an earlier loop is still being closed. The index may
  /// hold keyframes that the map no longer has. The `matches` of a returned loop are those on which both
  /// keyframes agree.
  std::optional<LoopConstraint> find(const Map& map, const PlaceIndex& index, KeyframeId keyframe);
  /// A loop that awaits its second keyframe continues to do so.
  void set_options(const MapperOptions& options) { options_ = options; }
  /// Drops the loop that awaits a second keyframe: the map was corrected or another one begun.
  void reset() { awaiting_.reset(); }

 private:
  std::vector<KeyframeId> candidates(const Map& map, const PlaceIndex& index, KeyframeId keyframe) const;
  std::optional<LoopConstraint> best_unambiguous(const Map& map, std::vector<LoopConstraint> loops) const;
  bool agree(const Map& map, const LoopConstraint& first, const LoopConstraint& second) const;

  MapperOptions options_;
  CameraModel camera_;
  LoopOptions loops_;
  std::optional<LoopConstraint> awaiting_;  // a loop that needs a second keyframe
  int waited_ = 0;                          // keyframes since then
};

}  // namespace mono_pose_tracker
