#pragma once

#include <functional>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

using IsLeftOut = std::function<bool(KeyframeId keyframe, int feature)>;

/// Makes all landmarks of a map anew, from descriptors alone, and adjusts it. What a map holds has been
/// matched and culled by its own poses, so that one which has gone wrong agrees with itself, and adjusting it
/// leads back to where it is (a head that turns by 20 degrees where the map says 15). Matches between
/// keyframes that are near in time do not know the poses: joined to tracks of three views or more, they
/// outvote them. False, and nothing changed, when no pose turns by 0.6 degrees or a keyframe would be left
/// with fewer than min_landmarks. min_landmarks: what holds a pose. is_left_out: features that are none of
/// the body.
bool remake_landmarks(const BundleOptions& bundle, const MatchOptions& matching, int min_landmarks,
                      const IsLeftOut& is_left_out, Map* map);

}  // namespace mono_pose_tracker
