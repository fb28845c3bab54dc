#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "mapping/pose_support.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

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
/// (kMaxDrift in aliased_places.h). An aliased place can pass; LoopFinder handles that.
std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const Map& map, KeyframeId keyframe,
                                          KeyframeId place);

/// Median error of the other loop's points under this loop's similarity, px in the other's old place.
double loop_disagreement_px(const Map& map, const LoopConstraint& loop, const LoopConstraint& other);

}  // namespace mono_pose_tracker
