#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether the landmarks that two keyframes see tell the way between the two well enough for depths to be
// measured by it. A camera that only turns has moved by what its poses are off; whatever were triangulated by
// that would stand at a depth of its own making, and hold the next poses to it.
bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second);

}  // namespace mono_pose_tracker
