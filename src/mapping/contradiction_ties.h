#pragma once

#include <set>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"
#include "mono_pose_tracker/mapping/remade_landmarks.h"

namespace mono_pose_tracker {

// Where two keyframes that follow each other contradict the map (mapping/contradiction.h) though neither has
// a pose that agrees with both sides (contradicted_pose.h), the map is torn: what is near is in it twice,
// once as those before have it, once as those after, and what is far holds the two together. What the first
// sees of the map is matched to the second by descriptors alone; where the second has a pose in which it does
// not contradict that, or else one motion explains nine tenths of the matches, what agrees becomes one
// landmark. The poses are left to a bundle adjustment that follows, with a wide loss, and to whether less
// contradicts then: what another body has that goes the same way stays two. What was loaded stays as it is.
// Returns the keyframes that were tied.
// matches: of the map's keyframes.
std::set<KeyframeId> tie_across_contradictions(const MapperOptions& options, const MatchesInTime& matches,
                                               const IsLeftOut& is_left_out, Map* map);

// Pairs of keyframes that follow each other and contradict the map, either way; as above none of an earlier
// run.
int count_contradictions(const Map& map, const MatchesInTime& matches);

}  // namespace mono_pose_tracker
