#pragma once

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "common/statistics.h"

namespace mono_pose_tracker {

struct ObjectImage {
  cv::Mat bgr;
  cv::Mat object;  // 255 = the object
};

inline cv::Mat ellipse_mask(cv::Size size, cv::Point centre) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8UC1);
  cv::ellipse(mask, centre, {45, 70}, 0, 0, 360, 255, cv::FILLED);
  return mask;
}

inline void add_noise(double sigma, std::uint64_t seed, cv::Mat* bgr) {
  Random random(seed);
  for (int y = 0; y < bgr->rows; ++y) {
    for (int i = 0; i < 3 * bgr->cols; ++i) {
      std::uint8_t& v = bgr->ptr<std::uint8_t>(y)[i];
      v = cv::saturate_cast<std::uint8_t>(v + sigma * random.normal());
    }
  }
}

/// An ellipse of one colour before another, 320x240.
inline ObjectImage object_before(const cv::Scalar& backdrop, const cv::Scalar& color, double noise,
                                 std::uint64_t seed) {
  ObjectImage image;
  image.object = ellipse_mask({320, 240}, {160, 120});
  image.bgr = cv::Mat(image.object.size(), CV_8UC3, backdrop);
  image.bgr.setTo(color, image.object);
  add_noise(noise, seed, &image.bgr);
  return image;
}

/// Intersection over union.
inline double overlap(const cv::Mat& a, const cv::Mat& b) {
  const double both = cv::countNonZero((a != 0) & (b != 0)), either = cv::countNonZero((a != 0) | (b != 0));
  return either == 0 ? 1.0 : both / either;
}

/// Blotches of many sizes and colours.
inline cv::Mat texture(cv::Size size, std::uint64_t seed) {
  cv::Mat image(size, CV_8UC3, cv::Scalar(110, 110, 110));
  Random random(seed);
  const int count = size.area() / 60;
  for (int i = 0; i < count; ++i) {
    const cv::Point centre(static_cast<int>(random.index(size.width)),
                           static_cast<int>(random.index(size.height)));
    const cv::Scalar color(random.uniform(40, 200), random.uniform(40, 200), random.uniform(40, 200));
    cv::circle(image, centre, 2 + static_cast<int>(random.index(7)), color, cv::FILLED, cv::LINE_AA);
  }
  return image;
}

}  // namespace mono_pose_tracker
