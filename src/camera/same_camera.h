#pragma once

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// A hundredth of what features are located to [px]: what drivers that compute their calibration for each
/// image round differently each time.
inline constexpr double kCalibrationRoundingPx = 1e-3;

/// A change of the calibration that costs less than features are located to [px]: drivers that estimate it
/// anew for each image (autofocus, image stabilisation of a phone) vary it by tenths of a pixel.
inline constexpr double kToleratedCalibrationChangePx = 0.2;

/// Whether two calibrations are of one camera: of images of one size, in which every pixel looks where it
/// does by the other, to so many pixels.
bool is_same_camera(const CameraParameters& a, const CameraParameters& b,
                    double tolerance_px = kCalibrationRoundingPx);

/// In words, of two cameras that are not the same.
std::string difference(const CameraParameters& a, const CameraParameters& b);

}  // namespace mono_pose_tracker
