#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

// Frames of a trajectory, by index, where the camera can hardly have been: one or two in a row, from which
// the frame before and the one after are ten times as far as it moves in that time about there; and more
// within a second, into which and out of which no camera moves (geometry/motion_prior.h), while past them the
// way goes on. least: so much at the least, in the map's unit; a camera that stands still moves by noise.
std::set<std::int64_t> stray_frames(std::vector<RegisteredFrame> trajectory, double least);

}  // namespace mono_pose_tracker
