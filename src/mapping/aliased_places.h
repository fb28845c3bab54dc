#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Of the best place's points: a look-alike lacks what is particular to the right place. With more than that,
/// the two cannot be told apart.
constexpr double kAliasedShare = 0.75;

/// Of the way between two keyframes: what tracking drifts by without being lost is a tenth at most where we
/// have measured it; three times that. Look-alikes a stretch further on are off by the whole way.
constexpr double kMaxDrift = 0.3;
/// rad: a heading that goes astray evenly along the way moves its end by half of that. What looks alike where
/// the camera went the other way, as the two walls of a corridor, is turned by far more.
constexpr double kMaxRotationDrift = 2 * kMaxDrift;

/// Length of the way from one keyframe to the other, along those between in time, in the map's unit: a map
/// that was joined has its own in another order.
double path_length_between(const TrackingMap& map, const KeyframeView& one, const KeyframeView& other);

/// px, median: how far points are in the image from where they are expected. Each pair: where it is expected
/// and where it is, in the camera's frame. A million for what lies behind the camera, and where nothing is
/// expected in view.
double disagreement_px(const CameraModel& camera,
                       const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& x_in_camera);

}  // namespace mono_pose_tracker
