#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "tracking/finished_map.h"

namespace mono_pose_tracker {

std::set<std::int64_t> frames_of(const std::vector<RegisteredFrame>& trajectory);

// Number of frames with a pose in any map but the first.
std::size_t frames_outside_first(const std::vector<FinishedMap>& maps);

// Removes maps that were begun while the camera was lost and whose frames all have a pose in the first map.
// Loaded maps stay.
void exclude_covered_maps(std::vector<FinishedMap>* maps);

}  // namespace mono_pose_tracker
