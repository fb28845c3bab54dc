#include "mono_pose_tracker/camera/same_camera.h"

#include <algorithm>

namespace mono_pose_tracker {

bool is_same_camera(const CameraParameters& a, const CameraParameters& b) {
  constexpr double kSame = 1e-3;  // px: a hundredth of what features are found to
  constexpr int kSteps = 8;       // across the image; distortion has no finer structure
  if (a == b) return true;
  if (a.width != b.width || a.height != b.height) return false;
  const CameraModel first(a), second(b);
  const double focal = std::max(first.focal(), second.focal());
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel((a.width - 1.0) * column / kSteps, (a.height - 1.0) * row / kSteps);
      if (!(focal * (first.bearing(pixel) - second.bearing(pixel)).norm() <= kSame)) return false;
    }
  }
  return true;
}

}  // namespace mono_pose_tracker
