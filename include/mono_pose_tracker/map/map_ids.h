#pragma once

namespace mono_pose_tracker {

using KeyframeId = int;
using LandmarkId = int;
constexpr LandmarkId kNoLandmark = -1;

}  // namespace mono_pose_tracker
