#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Of each keyframe the landmarks that most keyframes see, two at least: they tie the most views together for
// what they cost. Sorted.
std::vector<LandmarkId> most_observed_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                int max_of_keyframe);

}  // namespace mono_pose_tracker
