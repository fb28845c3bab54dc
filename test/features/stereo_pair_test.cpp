#include "features/stereo_pair.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "support/random_texture.h"

namespace mono_pose_tracker {
namespace {

// Two views of a texture, the second shifted by a disparity that grows downwards, with noise of its own.
cv::Mat view_of(const cv::Mat& texture, double disparity) {
  cv::Mat view(texture.rows, texture.cols - 60, CV_8UC1), noise(view.size(), CV_8UC1);
  for (int y = 0; y < view.rows; ++y) {
    const int shift = static_cast<int>(disparity * (0.5 + 0.5 * y / view.rows));
    texture(cv::Rect(shift, y, view.cols, 1)).copyTo(view.row(y));
  }
  cv::randn(noise, 5, 3);
  return view + noise;
}

cv::Mat pair_of(const cv::Mat& a, const cv::Mat& b, bool is_wide) {
  cv::Mat pair;
  if (is_wide) {
    cv::hconcat(a, b, pair);
  } else {
    cv::vconcat(a, b, pair);
  }
  return pair;
}

TEST(StereoPair, SideBySideAndOneAboveTheOther) {
  cv::setRNGSeed(1);
  const cv::Mat texture = random_texture(300, 240, 7);
  const cv::Mat left = view_of(texture, 0), right = view_of(texture, 16);
  const std::string side_by_side = stereo_pair_text(pair_of(left, right, true));
  EXPECT_NE(side_by_side.find("left and right halves show the same"), std::string::npos) << side_by_side;
  cv::Mat colour;
  cv::cvtColor(pair_of(left, right, false), colour, cv::COLOR_GRAY2BGR);
  const std::string stacked = stereo_pair_text(colour);
  EXPECT_NE(stacked.find("upper and lower halves"), std::string::npos) << stacked;
}

TEST(StereoPair, OtherImagesAreNone) {
  const cv::Mat a = view_of(random_texture(300, 240, 7), 0), b = view_of(random_texture(300, 240, 8), 0);
  EXPECT_EQ(stereo_pair_text(pair_of(a, b, true)), "") << "a wide image";
  EXPECT_EQ(stereo_pair_text(a), "");
  EXPECT_EQ(stereo_pair_text(cv::Mat()), "");
  EXPECT_EQ(stereo_pair_text(cv::Mat(240, 640, CV_8UC1, cv::Scalar(80))), "") << "without texture";
  EXPECT_EQ(stereo_pair_text(cv::Mat(8, 640, CV_8UC3, cv::Scalar(80))), "") << "a strip";
}

}  // namespace
}  // namespace mono_pose_tracker
