#include "camera/same_camera.h"

#include <algorithm>

#include "common/formatted.h"

namespace mono_pose_tracker {

bool is_same_camera(const CameraParameters& a, const CameraParameters& b, double tolerance_px) {
  constexpr int kSteps = 8;  // across the image; distortion has no finer structure
  if (a == b) return true;
  if (a.width != b.width || a.height != b.height) return false;
  const CameraModel first(a), second(b);
  const double focal = std::max(first.focal(), second.focal());
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel((a.width - 1.0) * column / kSteps, (a.height - 1.0) * row / kSteps);
      if (!(focal * (first.bearing(pixel) - second.bearing(pixel)).norm() <= tolerance_px)) return false;
    }
  }
  return true;
}

std::string difference(const CameraParameters& a, const CameraParameters& b) {
  if (a.width != b.width || a.height != b.height) {
    return formatted("%dx%d, then %dx%d", a.width, a.height, b.width, b.height);
  }
  if (a.fx != b.fx || a.fy != b.fy) {
    return formatted("fx %.9g, fy %.9g, then fx %.9g, fy %.9g", a.fx, a.fy, b.fx, b.fy);
  }
  if (a.cx != b.cx || a.cy != b.cy) {
    return formatted("cx %.9g, cy %.9g, then cx %.9g, cy %.9g", a.cx, a.cy, b.cx, b.cy);
  }
  return "different distortion";
}

}  // namespace mono_pose_tracker
