#pragma once

#include <array>
#include <string>

namespace mono_pose_tracker {

/// Largest shift of a pixel by an ignored skew [px]. It is below the localisation error of features. The
/// default options of camera_calibration leave some hundredths in a fisheye calibration.
inline constexpr double kMaxSkewShiftPx = 0.5;

/// Checks a camera matrix given row by row: fx skew cx 0 fy cy 0 0 1. The camera model has no skew. A skew
/// that moves no pixel of an image of this height by more than kMaxSkewShiftPx is ignored. Returns a one-line
/// note about an ignored skew, empty below 0.001 px. Throws std::invalid_argument on any other matrix, with a
/// text that continues the matrix's name.
std::string require_camera_matrix(const std::array<double, 9>& matrix, int height_px);

}  // namespace mono_pose_tracker
