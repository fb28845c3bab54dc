#pragma once

#include <cstdint>

namespace mono_pose_tracker {

using KeyframeId = int;
using LandmarkId = int;
constexpr LandmarkId kNoLandmark = -1;

/// Frames of earlier runs, whose map was loaded from a file, come before 0.
constexpr bool is_of_earlier_run(std::int64_t frame_index) { return frame_index < 0; }

}  // namespace mono_pose_tracker
