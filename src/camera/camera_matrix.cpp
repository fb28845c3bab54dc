#include "camera/camera_matrix.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/formatted.h"

namespace mono_pose_tracker {
namespace {

constexpr double kRounding = 1e-3;  // px

/// Skew moves the pixels of a row sideways, in proportion to the row's distance from that of the centre.
double largest_skew_shift_px(const std::array<double, 9>& matrix, int height_px) {
  const double skew = matrix[1], fy = matrix[4], cy = matrix[5];
  return std::abs(skew / fy) * std::max(std::abs(cy), std::abs(height_px - 1 - cy));
}

}  // namespace

std::string require_camera_matrix(const std::array<double, 9>& matrix, int height_px) {
  // The last row divides pixels, of which there are as many as the focal length is long.
  const double divided = kRounding / std::max({1.0, std::abs(matrix[0]), std::abs(matrix[4])});
  const auto is = [&](std::size_t place, double value, double within) {
    return std::abs(matrix[place] - value) <= within;  // false of what is no number
  };
  if (!std::isfinite(matrix[1]) || !is(3, 0, kRounding) || !is(6, 0, divided) || !is(7, 0, divided) ||
      !is(8, 1, divided)) {
    throw std::invalid_argument("is not of the form fx 0 cx 0 fy cy 0 0 1: expected a camera without skew");
  }
  if (is(1, 0, kRounding)) return "";
  const double shift = largest_skew_shift_px(matrix, height_px);
  if (!(shift <= kMaxSkewShiftPx)) {
    throw std::invalid_argument(formatted(
        "has a skew of %.3g px, which moves pixels by up to %.2g px: expected a camera without skew (%.2g px "
        "at most). Calibrate again with the skew held at zero (cameracalibrator.py --fisheye-fix-skew)",
        matrix[1], shift, kMaxSkewShiftPx));
  }
  return shift <= kRounding ? ""
                            : formatted(
                                  "the skew of %.3g px is ignored: it moves no pixel by more than "
                                  "%.2g px",
                                  matrix[1], shift);
}

}  // namespace mono_pose_tracker
