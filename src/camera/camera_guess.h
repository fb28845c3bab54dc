#pragma once

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Range of fields of view that may be guessed, in degrees. Outside it a pinhole camera makes little sense.
constexpr double kMinHfovDeg = 5, kMaxHfovDeg = 150;

/// A camera of which only the horizontal field of view is known: square pixels, the principal point in the
/// image centre, no distortion. hfov_deg: from the left to the right edge of the image. Throws
/// std::invalid_argument, one line, on an angle out of range or an empty image.
CameraParameters guess_camera(int width_px, int height_px, double hfov_deg);

}  // namespace mono_pose_tracker
