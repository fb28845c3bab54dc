#pragma once

#include <memory>

#include "mono_pose_tracker/map/tracking_map.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

// What is published and written of a map; empty where there is none.
std::shared_ptr<const MapSnapshot> snapshot_of(const TrackingMapPtr& map);

}  // namespace mono_pose_tracker
