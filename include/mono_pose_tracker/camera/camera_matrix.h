#pragma once

#include <array>

namespace mono_pose_tracker {

/// Checks the matrix of a camera without skew, row by row: fx 0 cx 0 fy cy 0 0 1. Throws
/// std::invalid_argument on any other, with a text that continues the matrix's name; what moves pixels by no
/// more than a thousandth passes as rounding.
void require_camera_matrix(const std::array<double, 9>& matrix);

}  // namespace mono_pose_tracker
