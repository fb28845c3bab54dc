#pragma once

#include <array>

namespace mono_pose_tracker {

/// Of a camera without skew, row by row: fx 0 cx 0 fy cy 0 0 1. Throws std::invalid_argument, which goes on
/// behind the matrix' name, on any other; what moves pixels by a thousandth is rounding.
void require_camera_matrix(const std::array<double, 9>& matrix);

}  // namespace mono_pose_tracker
