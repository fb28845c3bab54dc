#pragma once

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/map/tracking_map.h"

namespace mono_pose_tracker {

/// Whether the map is of something that stays before the camera, as an object does that turns: each keyframe
/// has two thirds of its landmarks before it and within its image at least, hidden or not, as a part of an
/// object may be cut off now and then. Of a place that the camera goes through half is behind it or beside it
/// after ten keyframes.
bool stays_in_view(const Map& map);

/// Whether the newest keyframe has that many before it: what an object's have, a place's soon do not.
bool newest_has_in_view(const TrackingMap& map, const CameraModel& camera);

}  // namespace mono_pose_tracker
