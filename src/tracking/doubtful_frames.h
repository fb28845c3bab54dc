#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

// Frames of the trajectory whose poses are doubtful, but for those between two that are beyond doubt: such
// can't be far off, or they were found astray.
std::vector<std::int64_t> doubtful_alone(const std::vector<RegisteredFrame>& trajectory,
                                         const std::set<std::int64_t>& doubtful);

// Whether so many doubtful poses of so many may take the path off by more than a known one is
// (mapping/path_precision.h).
bool may_distort_path(std::size_t doubtful, std::size_t registered);

}  // namespace mono_pose_tracker
