#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether two of the rays that see the landmark differ by at least the angle (radians).
bool has_parallax(const Map& map, const Landmark& landmark, double min_angle);

// The widest angle between two of these rays (radians).
double widest_parallax(const Map& map, const Landmark& landmark);

}  // namespace mono_pose_tracker
