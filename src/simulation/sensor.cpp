#include "simulation/sensor.h"

#include <opencv2/imgproc.hpp>

#include "common/random.h"
#include "common/threads.h"

namespace mono_pose_tracker {

cv::Mat expose(const cv::Mat& light, const SensorEffects& effects, int threads) {
  cv::Mat blurred = light;
  if (effects.blur_px > 0) {
    cv::GaussianBlur(light, blurred, cv::Size(), effects.blur_px, effects.blur_px, cv::BORDER_REPLICATE);
  }
  cv::Mat image(light.size(), CV_8UC3);
  parallel_for(light.rows, threads, [&](int row) {
    // A generator a row: the noise does not depend on which thread comes first.
    Random random(effects.noise_seed ^ (static_cast<std::uint64_t>(row + 1) * 0xd1342543de82ef95ull));
    for (int column = 0; column < light.cols; ++column) {
      const double noise = effects.noise_grey_levels > 0 ? effects.noise_grey_levels * random.normal() : 0;
      const cv::Vec3f& in = blurred.at<cv::Vec3f>(row, column);
      cv::Vec3b& out = image.at<cv::Vec3b>(row, column);
      for (int c = 0; c < 3; ++c)
        out[c] = cv::saturate_cast<std::uint8_t>(255 * effects.gain * in[c] + noise);
    }
  });
  return image;
}

}  // namespace mono_pose_tracker
