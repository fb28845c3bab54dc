#pragma once

#include <set>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// Keyframes of a stretch of time that does not belong where it lies in the map: what is seen at both its
/// ends contradicts the map (mapping/contradiction.h), and at one of them most of it does; or most of what
/// two keyframes have in common there moves as one in another way than they do (mapping/second_motion.h; not
/// where that is so in a quarter of all, which is a second body), while the keyframe before the stretch and
/// the one after it do not show that. What is before and after it must hang together without it, as firmly as
/// a seam (mapping/seam.h). So it is where a hand covers an object for a while and is followed in its place.
/// Empty where there is none, where it is more than a quarter of the map (a third, where those two do not),
/// or holds keyframes of an earlier run or the first two, by which the map has its frame. Of several,
/// the shortest. matches: of the map's keyframes. Once ransac.cancelled, none.
std::set<KeyframeId> misplaced_stretch(const Map& map, const MatchesInTime& matches,
                                       const MatchOptions& matching, const RansacOptions& ransac);

}  // namespace mono_pose_tracker
