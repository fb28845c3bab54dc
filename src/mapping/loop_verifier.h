#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/pose_support.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// A keyframe that shows a place the map has already, seen again after drift. What the keyframe sees stands
/// twice in the map then: as the old place has it and as the new side has it.
struct LoopConstraint {
  KeyframeId from = -1, to = -1;  // the old place, the new keyframe
  Sim3 old_from_new;              // takes a point of the map as the new side has it to where the old has it
  Sim3 from_from_to;              // camera of `to` seen from that of `from`: an edge of the pose graph
  std::vector<std::pair<LandmarkId, LandmarkId>> matches;  // new, old: one and the same, to be fused
  PoseSupport support;                                     // of the old landmarks in the new image
  double drift = 0;  // how far it moves the new keyframe, of the way between the two
};

/// Compares a keyframe with an old place (a keyframe and those that share most with it): descriptors, RANSAC
/// for a similarity over points that both sides have, guided matching with all that the old place sees, the
/// similarity anew. Nothing when too few points agree or too little of what should be in view is found
/// (pose_support.h), or when the similarity moves the keyframe further than drift can be (kMaxDrift in
/// loop_verifier.cpp). A place that looks the same passes; see LoopFinder for what is done about it.
std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const TrackingMap& map,
                                          KeyframeId keyframe, KeyframeId place);

/// Whether the other loop's points fit this one's similarity: median error in px, in the other's old place.
double loop_disagreement_px(const TrackingMap& map, const LoopConstraint& loop, const LoopConstraint& other);

}  // namespace mono_pose_tracker
