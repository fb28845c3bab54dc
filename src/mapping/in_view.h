#pragma once

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Whether the map is of something that stays before the camera, as an object does that turns: each keyframe
/// has two thirds of its landmarks before it and within its image at least, hidden or not, as a part of an
/// object may be cut off now and then. Of a place that the camera goes through half is behind it or beside it
/// after ten keyframes.
bool stays_in_view(const Map& map);

/// The same where parts of the map may lie elsewhere: most keyframes have half of its landmarks in view. (A
/// head, a third of whose map is of a hand and was put elsewhere: two thirds; a street and a room: two
/// fifths.)
bool mostly_stays_in_view(const Map& map);

/// Whether the camera goes past what the map is of: less than two thirds of the points are in its image, and
/// some are behind it. An object that goes out of the image, or comes near, never gets there.
bool has_left_behind(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map);

}  // namespace mono_pose_tracker
