#pragma once

#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "common/statistics.h"

namespace mono_pose_tracker {

/// Smooth random texture with structure at many scales: CV_8UC1.
inline cv::Mat random_texture(int width, int height, std::uint64_t seed) {
  Random random(seed);
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32F);
  for (const double sigma : {1.5, 3.0, 6.0, 12.0}) {
    cv::Mat noise(height, width, CV_32F);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) noise.at<float>(y, x) = static_cast<float>(random.normal());
    }
    cv::GaussianBlur(noise, noise, cv::Size(), sigma);
    sum += noise * (25.0 * sigma);
  }
  cv::Mat gray;
  sum.convertTo(gray, CV_8U, 1.0, 128.0);
  return gray;
}

}  // namespace mono_pose_tracker
