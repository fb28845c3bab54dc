#include "camera/camera_guess.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "common/angles.h"

namespace mono_pose_tracker {

CameraParameters guess_camera(int width_px, int height_px, double hfov_deg) {
  if (!(hfov_deg >= kMinHfovDeg && hfov_deg <= kMaxHfovDeg)) {
    std::ostringstream text;
    text << "hfov is " << hfov_deg << ", expected " << kMinHfovDeg << " to " << kMaxHfovDeg << " degrees";
    throw std::invalid_argument(text.str());
  }
  if (width_px <= 0 || height_px <= 0)
    throw std::invalid_argument("the image size is zero: expected a positive width and height");
  CameraParameters camera;
  camera.width = width_px;
  camera.height = height_px;
  camera.fx = camera.fy = 0.5 * width_px / std::tan(0.5 * hfov_deg * kDegree);
  // The centre of the first pixel is (0, 0).
  camera.cx = 0.5 * (width_px - 1);
  camera.cy = 0.5 * (height_px - 1);
  camera.distortion_model.clear();
  return camera;
}

}  // namespace mono_pose_tracker
