#pragma once

#include <array>
#include <string>

namespace mono_pose_tracker {

/// The most that a skew which is left out may move a pixel of the image [px]: less than features are located
/// to. The default options of camera_calibration leave some hundredths in a fisheye calibration.
inline constexpr double kMaxSkewShiftPx = 0.5;

/// Checks the matrix of a camera, row by row: fx skew cx 0 fy cy 0 0 1. Our cameras have no skew: one that
/// moves no pixel of an image of this height by more than kMaxSkewShiftPx is left out. Returns one line about
/// that, empty where it moves pixels by less than a thousandth. Throws std::invalid_argument on any other
/// matrix, with a text that continues the matrix's name.
std::string require_camera_matrix(const std::array<double, 9>& matrix, int height_px);

}  // namespace mono_pose_tracker
