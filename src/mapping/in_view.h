#pragma once

#include <cstddef>

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Shares of the landmarks, in [0, 1].
struct InViewOptions {
  double least_share = 2.0 / 3;    // in view
  double least_behind = 0.05;      // behind the camera: more than a few wrong landmarks
  std::size_t max_sampled = 1000;  // landmarks, for a share accurate to one or two hundredths
};

/// Whether the mapped object stays in front of the camera, as a rotating object does: at least two thirds of
/// the landmarks are in front of each keyframe and within its image, occluded or not, as an object may be cut
/// off at the image border. When the camera moves through a place, half of the landmarks are behind it or
/// outside the image after ten keyframes.
bool stays_in_view(const Map& map);

/// Whether the camera has passed the mapped structure: less than two thirds of the points are in its image,
/// and some are behind it. An object that leaves the image or comes near does not get behind the camera.
bool has_left_behind(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map);

}  // namespace mono_pose_tracker
