#pragma once

#include <optional>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// How much farther the newest keyframe's landmarks are than older ones about them in the images of these
// others: the median ratio of distances. Nothing where few lie among such ones.
//
// A turn on the spot says little of how far the camera went, and a wrong match or two decide: then all that
// is made of the step has another size than the map, and so has what follows.
std::optional<double> depth_jump(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& others);

// Whether half of the new landmarks or more are nearer than those about them by half as much again, or ten
// times as far.
bool makes_depths_jump(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& others);

}  // namespace mono_pose_tracker
