#pragma once

#include "mono_pose_tracker/map/tracking_map.h"

namespace mono_pose_tracker {

/// Of the way between two keyframes: what tracking drifts by without being lost is a tenth at most where we
/// have measured it; three times that. Look-alikes a stretch further on are off by the whole way.
constexpr double kMaxDrift = 0.3;
/// rad: a heading that goes astray evenly along the way moves its end by half of that. What looks alike where
/// the camera went the other way, as the two walls of a corridor, is turned by far more.
constexpr double kMaxDriftTurn = 2 * kMaxDrift;

/// Length of the way from one keyframe to the other, along those between in time, in the map's unit: a map
/// that was joined has its own in another order.
double way_between(const TrackingMap& map, const KeyframeView& one, const KeyframeView& other);

}  // namespace mono_pose_tracker
