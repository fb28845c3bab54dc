#include "camera/size_mismatch.h"

#include "common/formatted.h"

namespace mono_pose_tracker {
namespace {

std::string likely_cause(int width, int height, int camera_width, int camera_height) {
  if (width == camera_height && height == camera_width) {
    return "; width and height are swapped: images are read as stored, and their orientation tag is ignored. "
           "Calibrate with images in the stored orientation";
  }
  if (width == 2 * camera_width && height == camera_height) {
    return "; the image is twice as wide: if it is a stereo pair side by side, crop the images of one camera";
  }
  if (width == camera_width && height == 2 * camera_height) {
    return "; the image is twice as high: if it is a stereo pair one above the other, crop the images of one "
           "camera";
  }
  const bool is_scaled = static_cast<long>(width) * camera_height == static_cast<long>(height) * camera_width;
  return is_scaled && camera_width > 0
             ? formatted("; the image is the same view at %.4g times the size: calibrate at this size",
                         static_cast<double>(width) / camera_width)
             : "";
}

}  // namespace

std::string size_mismatch_text(int image_width, int image_height, int camera_width, int camera_height,
                               const std::string& origin) {
  return formatted("is %dx%d, the calibration is for %dx%d", image_width, image_height, camera_width,
                   camera_height) +
         (origin.empty() ? "" : " (" + origin + ")") +
         likely_cause(image_width, image_height, camera_width, camera_height);
}

}  // namespace mono_pose_tracker
