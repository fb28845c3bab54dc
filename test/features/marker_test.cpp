#include "features/marker.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "support/expect_error.h"

// Where the aruco module is not there, there is nothing to test.
#ifdef MONO_POSE_TRACKER_WITH_ARUCO
#include <opencv2/aruco.hpp>

namespace mono_pose_tracker {
namespace {

// Marker 7 of 5x5_100 on white, in perspective: its corners come to lie where `quad` says. Drawn at four
// times the size and made smaller, as a sensor's pixels take the mean of what they see.
cv::Mat image_with_marker(const std::vector<cv::Point2f>& quad) {
  cv::Mat marker;
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100), 7, 350, marker);
  cv::copyMakeBorder(marker, marker, 70, 70, 70, 70, cv::BORDER_CONSTANT, cv::Scalar(230));
  // The corner of a cell is half a pixel off the centre of its first pixel.
  const std::vector<cv::Point2f> corners = {
      {69.5f, 69.5f}, {419.5f, 69.5f}, {419.5f, 419.5f}, {69.5f, 419.5f}};
  std::vector<cv::Point2f> large_quad;
  for (const cv::Point2f& p : quad) large_quad.emplace_back(4 * p.x + 1.5f, 4 * p.y + 1.5f);
  cv::Mat large(960, 1280, CV_8UC1, cv::Scalar(230)), image;
  cv::warpPerspective(marker, large, cv::getPerspectiveTransform(corners, large_quad), large.size(),
                      cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  cv::resize(large, image, cv::Size(320, 240), 0, 0, cv::INTER_AREA);
  return image;
}

TEST(Marker, CornersAreFoundInTheirOrder) {
  const std::vector<cv::Point2f> quad = {{100.3f, 60.7f}, {190.1f, 71.4f}, {184.9f, 160.2f}, {95.6f, 150.5f}};
  const std::vector<Eigen::Vector2d> found = find_marker(image_with_marker(quad), "5x5_100", 7);
  ASSERT_EQ(found.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((found[i] - Eigen::Vector2d(quad[i].x, quad[i].y)).norm(), 0.35) << i;
  }
}

TEST(Marker, AnotherOneIsNotTaken) {
  const cv::Mat image = image_with_marker({{100, 60}, {190, 60}, {190, 150}, {100, 150}});
  EXPECT_TRUE(find_marker(image, "5x5_100", 8).empty());
  EXPECT_TRUE(find_marker(cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)), "5x5_100", 7).empty());
  expect_error<std::invalid_argument>([&] { find_marker(image, "9x9_1", 7); }, {"9x9_1"});
}

}  // namespace
}  // namespace mono_pose_tracker

#endif
