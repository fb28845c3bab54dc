#pragma once

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

// A pose that hangs on far things has its rotation right, but the camera may have gone anywhere. What is near
// then lies off the epipolar lines, finds no match, and so never enters the map to tell. Matches by
// descriptors alone with another keyframe do tell: where these agree on a motion that explains far more of
// them than the poses do, and nearly all landmarks that the keyframe sees as well (a second body's motion
// does not), that is the keyframe's pose; how far it went, the landmarks say as well as they can. Returns
// whether it was moved.
bool correct_astray_pose(const MapperOptions& options, KeyframeId newest, KeyframeId other, Map* map);

}  // namespace mono_pose_tracker
