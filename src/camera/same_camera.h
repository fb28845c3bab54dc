#pragma once

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Difference below which two calibrations are equal [px]: 1 % of the localisation error of features. Drivers
/// that compute their calibration for each image round it differently each time.
inline constexpr double kCalibrationRoundingPx = 1e-3;

/// Change of the calibration that is tolerated [px]: it is below the localisation error of features. Drivers
/// that estimate the calibration for each image (autofocus, image stabilisation of a phone) vary it by tenths
/// of a pixel.
inline constexpr double kToleratedCalibrationChangePx = 0.2;

/// Whether two calibrations are of one camera: the image sizes are equal, and no pixel's viewing ray differs
/// by more than the tolerance [px].
bool is_same_camera(const CameraParameters& a, const CameraParameters& b,
                    double tolerance_px = kCalibrationRoundingPx);

/// In words, of two cameras that are not the same.
std::string difference(const CameraParameters& a, const CameraParameters& b);

}  // namespace mono_pose_tracker
