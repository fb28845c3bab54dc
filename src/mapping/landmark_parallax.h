#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether two viewing rays of the landmark differ by at least the angle (radians).
bool has_parallax(const Map& map, const Landmark& landmark, double min_angle);

// The largest angle between two viewing rays of the landmark (radians).
double widest_parallax(const Map& map, const Landmark& landmark);

}  // namespace mono_pose_tracker
