#pragma once

#include <string>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// run_growth_study along a street and before one wall, with the memory that each keyframe takes (resident,
/// of the whole process, features and all).
Json run_growth(int most_keyframes, const TrackerOptions& options);

/// The result as tables for people.
std::string growth_table(const Json& growth);

}  // namespace mono_pose_tracker
