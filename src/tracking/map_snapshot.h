#pragma once

#include <memory>
#include <vector>

#include "map/frame_poses.h"
#include "map/tracking_map.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// What is published and written of a map; empty where there is none.
std::shared_ptr<const MapSnapshot> snapshot_of(const TrackingMapPtr& map);

/// The same of the newest keyframe alone, with the points that it sees: that takes no longer in a large map.
MapSnapshot newest_view_of(const TrackingMapPtr& map);

/// Every frame posed against the map, by index: a keyframe where it is itself, others on their reference;
/// what was posed while the map was of another geometry between those whose poses hold.
std::vector<RegisteredFrame> trajectory_in(const TrackingMap& map, const FramePoses& poses);

}  // namespace mono_pose_tracker
