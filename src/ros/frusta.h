#pragma once

#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// How deep cameras are to be drawn, in map units: a tenth of the median depth of what the newest keyframe
/// has in its view, so that they read well at any scale, also when most of the map has been left behind. 0.1
/// while there is nothing in view.
double frustum_depth(const MapSnapshot& snapshot, const CameraParameters& camera);

/// Keyframes that can be told from each other when they are drawn `depth` deep: the newest, and each older
/// one that is half a depth away, or turned by 15 degrees, from all that are drawn; not more than can be
/// looked through.
std::vector<KeyframePose> thinned_keyframes(const std::vector<KeyframePose>& keyframes, double depth);

/// One marker of line segments: the frustum of each keyframe, `depth` map units deep.
visualization_msgs::MarkerArray to_keyframe_markers(const std_msgs::Header& header,
                                                    const CameraParameters& camera,
                                                    const std::vector<KeyframePose>& keyframes, double depth);

/// The camera as it is now: a frustum with its upper side marked. Without a pose: the marker is taken away.
visualization_msgs::Marker to_camera_marker(const std_msgs::Header& header, const CameraParameters& camera,
                                            const Rigid3* map_from_camera, double depth);

}  // namespace mono_pose_tracker
