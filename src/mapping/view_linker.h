#pragma once

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

// Ties keyframes together that look at the same place but share few landmarks, because the map drifted
// between their times: landmarks of one are matched to the other by descriptors alone, P3P RANSAC confirms,
// and what agrees becomes one landmark. The poses are left to a bundle adjustment that follows. Returns how
// many pairs were tied.
int link_views(const MapperOptions& options, Map* map);

}  // namespace mono_pose_tracker
