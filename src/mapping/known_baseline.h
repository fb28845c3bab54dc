#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct KnownBaselineOptions {
  double min_significance = 5;  // standard deviations: the baseline, and with it all depths, is then
                                // uncertain by a fifth
};

// Whether the common landmarks of two keyframes determine their baseline well enough for triangulation. When
// the camera only rotates, the estimated baseline is pure error. Points triangulated from it would have
// meaningless depths and would bias the next poses.
bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second);

// Whether two viewing rays of the landmark differ by at least the angle (radians).
bool has_parallax(const Map& map, const Landmark& landmark, double min_angle);

// The largest angle between two viewing rays of the landmark (radians).
double widest_parallax(const Map& map, const Landmark& landmark);

}  // namespace mono_pose_tracker
