#pragma once

#include <cstdint>
#include <vector>

#include "map/frame.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// A resected frame that shall become a keyframe of a map; its pose is given relative to a keyframe, which
/// may move meanwhile.
struct KeyframeCandidate {
  std::uint32_t map_id = 0;
  Frame frame;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  std::vector<FrameObservation> observations;
  std::uint64_t corrections = 0;  // sequence of the last MapCorrection that its ids and lengths know of
};

}  // namespace mono_pose_tracker
