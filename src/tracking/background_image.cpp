#include "tracking/background_image.h"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "io/image_coding.h"

namespace mono_pose_tracker {

cv::Mat read_background_image(const SegmentationOptions& options) {
  if (!options.is_by_background() || options.background_image.empty()) return {};
  DecodedImage read = read_image(options.background_image);
  if (!read.problem.empty()) {
    throw std::invalid_argument("segmentation/background_image = " + read.problem +
                                ": expected an image that can be read");
  }
  if (read.image.channels() == 1) cv::cvtColor(read.image, read.image, cv::COLOR_GRAY2BGR);
  return read.image;
}

}  // namespace mono_pose_tracker
