#include "mono_pose_tracker/camera/camera_matrix.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mono_pose_tracker {

void require_camera_matrix(const std::array<double, 9>& matrix) {
  constexpr double kRounding = 1e-3;  // px
  // The last row divides pixels, of which there are as many as the focal length is long.
  const double divided = kRounding / std::max({1.0, std::abs(matrix[0]), std::abs(matrix[4])});
  const auto is = [&](std::size_t place, double value, double within) {
    return std::abs(matrix[place] - value) <= within;  // false of what is no number
  };
  if (!is(1, 0, kRounding) || !is(3, 0, kRounding) || !is(6, 0, divided) || !is(7, 0, divided) ||
      !is(8, 1, divided)) {
    throw std::invalid_argument("is not of the form fx 0 cx 0 fy cy 0 0 1: expected a camera without skew");
  }
}

}  // namespace mono_pose_tracker
