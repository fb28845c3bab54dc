#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether two of the rays that see the landmark differ by at least the angle (radians).
bool has_parallax(const Map& map, const Landmark& landmark, double min_angle);

}  // namespace mono_pose_tracker
