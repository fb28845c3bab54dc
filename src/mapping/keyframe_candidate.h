#pragma once

#include <cstdint>
#include <vector>

#include "map/frame.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// A registered frame that is to become a keyframe of a map. Its pose is relative to a keyframe, which may be
/// corrected meanwhile.
struct KeyframeCandidate {
  std::uint32_t map_id = 0;
  Frame frame;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  std::vector<FrameObservation> observations;
  std::uint64_t corrections = 0;  // sequence of the last MapCorrection applied to its ids and lengths
};

}  // namespace mono_pose_tracker
