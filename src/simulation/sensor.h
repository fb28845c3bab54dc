#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// What the camera does to the light of one frame, in this order.
struct SensorEffects {
  double blur_px = 0;  // standard deviation of a Gaussian
  double gain = 1;     // of the exposure
  double noise_grey_levels =
      0;  // standard deviation, of 255; the same in the three colours, so in the grey image too
  std::uint64_t noise_seed = 0;
};

/// From light (CV_32FC3, [0, 1]) to the image (CV_8UC3).
cv::Mat expose(const cv::Mat& light, const SensorEffects& effects, int threads);

}  // namespace mono_pose_tracker
