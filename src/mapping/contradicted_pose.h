#pragma once

#include <set>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"
#include "mono_pose_tracker/mapping/remade_landmarks.h"

namespace mono_pose_tracker {

// Of two keyframes that follow each other and contradict the map (mapping/contradiction.h) one is posed anew,
// by what those before and after it see of the map, matched by descriptors alone (paper, steps 4a and 4b).
// Guided matching looks only near where a pose has the points: a pose that hangs on far things and is off
// finds nothing of what is near, which would tell. The new one is taken where it explains plainly more of the
// matches than the old one, and half of what the keyframe sees as well: the motion of a second body that
// turns does not. (One that goes on without turning before a skyline is the camera's, where all that is near
// is it.) What the keyframe sees of the map is then what agrees with its pose. Returns the keyframes that
// were moved; those of an earlier run stay, as do the first two, by which the map has its frame.
// matches: of the map's keyframes.
std::set<KeyframeId> correct_contradicted_poses(const MapperOptions& options, const MatchesInTime& matches,
                                                const IsLeftOut& is_left_out, Map* map);

}  // namespace mono_pose_tracker
