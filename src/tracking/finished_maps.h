#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "tracking/finished_map.h"

namespace mono_pose_tracker {

std::set<std::int64_t> frames_of(const std::vector<RegisteredFrame>& trajectory);

// Whether it came from a file: frames of earlier runs come before 0.
bool is_loaded(const FinishedMap& map);

// Frames that have a pose, though none in the first map.
std::size_t frames_outside_first(const std::vector<FinishedMap>& maps);

// What was begun while the camera was lost tells nothing more when every frame of it has found its place in
// the first map; what was loaded stays.
void exclude_covered_maps(std::vector<FinishedMap>* maps);

// A map beside the first of fewer images than these is not confirmed. Why it has nothing in common with the
// first is not known, and so few images hardly contradict each other: of ten to sixteen, maps were 5 to 9 %
// off that all was right about; none of twenty or more.
constexpr std::size_t kLeastOutsideFirst = 20;

}  // namespace mono_pose_tracker
