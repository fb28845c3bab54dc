#pragma once

#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// Depth of the drawn frusta in map units: a tenth of the median depth of the landmarks visible in the newest
/// keyframe, so that they have a useful size at any scale. 0.1 if there are none.
double frustum_depth(const MapSnapshot& snapshot, const CameraParameters& camera);

/// Keyframes that are distinguishable when drawn `depth` deep: the newest, and each older one that differs
/// from all drawn ones by half a depth or 15 degrees. Their number is limited.
std::vector<KeyframePose> thinned_keyframes(const std::vector<KeyframePose>& keyframes, double depth);

/// One marker of line segments: the frustum of each keyframe, `depth` map units deep.
visualization_msgs::MarkerArray to_keyframe_markers(const std_msgs::Header& header,
                                                    const CameraParameters& camera,
                                                    const std::vector<KeyframePose>& keyframes, double depth);

/// The camera as it is now: a frustum with its upper side marked. Without a pose: the marker is taken away.
visualization_msgs::Marker to_camera_marker(const std_msgs::Header& header, const CameraParameters& camera,
                                            const Rigid3* map_from_camera, double depth);

}  // namespace mono_pose_tracker
