#pragma once

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Whether the mapped object stays in front of the camera, as a rotating object does: at least two thirds of
/// the landmarks are in front of each keyframe and within its image, occluded or not, as an object may be cut
/// off at the image border. When the camera moves through a place, half of the landmarks are behind it or
/// outside the image after ten keyframes.
bool stays_in_view(const Map& map);

/// The same with a tolerance for misregistered parts of the map: most keyframes have half of the landmarks in
/// view. Measured shares: two thirds for a head with a third of its map from a misregistered hand; two fifths
/// for a street and a room.
bool mostly_stays_in_view(const Map& map);

/// Whether the camera has passed the mapped structure: less than two thirds of the points are in its image,
/// and some are behind it. An object that leaves the image or comes near does not get behind the camera.
bool has_left_behind(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map);

}  // namespace mono_pose_tracker
