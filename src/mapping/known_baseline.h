#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether the landmarks that two keyframes see tell the way between the two well enough for depths to be
// measured by it. Of a camera that only turns, the poses are as far apart as they are wrong: points
// triangulated from there would stand at depths of no meaning, and hold the next poses to them.
bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second);

}  // namespace mono_pose_tracker
