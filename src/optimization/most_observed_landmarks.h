#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// For each keyframe, at least two of its landmarks with the most observations: they connect the most views at
// the lowest cost. Sorted.
std::vector<LandmarkId> most_observed_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                int max_of_keyframe);

}  // namespace mono_pose_tracker
