#pragma once

#include <algorithm>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// What thresholds given "at 640 px" are multiplied by: the image's longer side, px, over 640, at least 1.
/// The longer one, so that a phone held upright is as strict as one that lies.
inline double image_scale(int width, int height) { return std::max(1.0, std::max(width, height) / 640.0); }

inline double image_scale(const CameraModel& camera) { return image_scale(camera.width(), camera.height()); }

/// px: what radii given as a share of the image are a share of, for the same reason.
inline int longer_side(const CameraModel& camera) { return std::max(camera.width(), camera.height()); }

}  // namespace mono_pose_tracker
