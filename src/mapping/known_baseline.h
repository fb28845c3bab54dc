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
bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second,
                       const KnownBaselineOptions& options = {});

}  // namespace mono_pose_tracker
