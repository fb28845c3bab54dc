#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Keyframes that observe the landmarks but are not free: those with the most observations, sorted.
std::vector<KeyframeId> fixed_keyframes(const Map& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& free, int max_fixed);

}  // namespace mono_pose_tracker
