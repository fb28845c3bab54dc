#pragma once

#include <set>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"

namespace mono_pose_tracker {

// Keyframes that contradict the map (mapping/contradiction.h) beside one that does not are posed anew by what
// those before and after them see of it, matched by descriptors alone (paper, step 4a and 4b). Guided
// matching looks only near where a pose has the points: a pose that hangs on far things and is off finds
// nothing of what is near, which would tell. One is taken where it explains far more of the matches than the
// old one, and most of what the keyframe sees as well: a second body's motion does not. What it sees of the
// map is then what agrees with it. Returns the keyframes that were moved; those of an earlier run stay, as do
// the first two, which hold the map's frame and scale. matches: of the map's keyframes.
std::set<KeyframeId> correct_contradicted_poses(const MapperOptions& options, const MatchesInTime& matches,
                                                Map* map);

}  // namespace mono_pose_tracker
