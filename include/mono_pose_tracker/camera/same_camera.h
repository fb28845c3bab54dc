#pragma once

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Whether two calibrations are of one camera: of images of one size, in which every pixel looks where it
/// does by the other to a thousandth of a pixel. Drivers that compute their calibration for each image round
/// it differently each time.
bool is_same_camera(const CameraParameters& a, const CameraParameters& b);

}  // namespace mono_pose_tracker
