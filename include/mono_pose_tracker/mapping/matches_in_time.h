#pragma once

#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Of the keyframes in the order of time: the i-th with the one after it, or so many after it. What asks a
/// finished map for contradictions matches them anew by descriptors alone, all by the same matches.
using MatchesInTime = std::vector<std::vector<Match>>;

/// On so many threads; the result is the same for any number.
MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads, int apart = 1);

}  // namespace mono_pose_tracker
