#pragma once

#include <memory>
#include <vector>

#include "map/frame_poses.h"
#include "map/tracking_map.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// The content of a map for publishing and writing; empty where there is no map.
std::shared_ptr<const MapSnapshot> snapshot_of(const TrackingMapPtr& map);

/// The same for the newest keyframe alone, with the points that it observes. Its cost does not grow with the
/// map.
MapSnapshot newest_view_of(const TrackingMapPtr& map);

/// Every frame registered in the map, by index. A keyframe has its own pose, another frame the one relative
/// to its reference. A frame registered before the map's geometry changed is interpolated between frames with
/// valid poses.
std::vector<RegisteredFrame> trajectory_in(const TrackingMap& map, const FramePoses& poses);

}  // namespace mono_pose_tracker
