#include "mono_pose_tracker/io/overview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/common/random.h"
#include "mono_pose_tracker/io/plot.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

/// A cube of points ahead of cameras on a straight line to the right.
Overview some_overview() {
  Overview overview;
  overview.title = "a cube";
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    ColoredPoint point;
    for (float& value : point.x_in_map) value = static_cast<float>(random.uniform(-1, 1));
    point.x_in_map.z() += 5;
    overview.points.push_back(point);
  }
  for (int i = 0; i < 20; ++i) overview.cameras.emplace_back(0.1 * i, 0, 0);
  return overview;
}

enum Color { kRed, kGreen, kBlue };

/// Pixels in which one channel stands out.
cv::Mat pixels_of(const cv::Mat& picture, Color color) {
  std::vector<cv::Mat> bgr;
  cv::split(picture, bgr);
  const int channel = color == kRed ? 2 : color == kGreen ? 1 : 0;
  cv::Mat rest = cv::max(bgr[(channel + 1) % 3], bgr[(channel + 2) % 3]), difference;
  cv::subtract(bgr[channel], rest, difference);
  return difference > 60;
}

TEST(Overview, PointsAreRedAboveTheGreenCameras) {
  const cv::Mat picture = draw_overview(some_overview());
  ASSERT_EQ(picture.type(), CV_8UC3);
  const int legend = 120, half = picture.cols / 2;
  const cv::Mat above = picture(cv::Rect(0, legend, half, picture.rows - legend));
  const cv::Mat red = pixels_of(above, kRed), green = pixels_of(above, kGreen);
  EXPECT_GT(cv::countNonZero(red), 500);
  EXPECT_GT(cv::countNonZero(green), 100);
  EXPECT_EQ(cv::countNonZero(pixels_of(above, kBlue)), 0);
  std::vector<cv::Point> red_pixels, green_pixels;
  cv::findNonZero(red, red_pixels);
  cv::findNonZero(green, green_pixels);
  const cv::Rect points = cv::boundingRect(red_pixels), cameras = cv::boundingRect(green_pixels);
  EXPECT_LT(points.br().y, cameras.y);                           // z = 4 to 6 is forward of z = 0
  EXPECT_NEAR(points.width, points.height, 0.1 * points.width);  // equal axes: a cube is a square
  EXPECT_GT(cameras.width, 10 * cameras.height - 80);            // a line along x
  // From the side forward is to the right.
  const cv::Mat side = picture(cv::Rect(half, legend, half, picture.rows - legend));
  red_pixels.clear();
  cv::findNonZero(pixels_of(side, kRed), red_pixels);
  cv::findNonZero(pixels_of(side, kGreen), green_pixels);
  EXPECT_GT(cv::boundingRect(red_pixels).x, cv::boundingRect(green_pixels).br().x);
}

TEST(Overview, AFewFarPointsDoNotShrinkTheRest) {
  Overview overview = some_overview();
  const int before = cv::countNonZero(pixels_of(draw_overview(overview), kRed));
  ColoredPoint far;
  far.x_in_map = {1e4f, 1e6f, 1e9f};
  overview.points.push_back(far);
  far.x_in_map = {0, std::numeric_limits<float>::infinity(), std::nanf("")};
  overview.points.push_back(far);
  EXPECT_GT(cv::countNonZero(pixels_of(draw_overview(overview), kRed)), 0.9 * before);
}

TEST(Overview, TruthIsBlueWhenGiven) {
  Overview overview = some_overview();
  for (const Eigen::Vector3d& camera : overview.cameras) {
    overview.true_cameras.push_back(camera + Eigen::Vector3d(0, 0, 0.5));
  }
  EXPECT_GT(cv::countNonZero(pixels_of(draw_overview(overview), kBlue)), 200);
}

TEST(Overview, NothingToDrawIsAPictureToo) {
  EXPECT_FALSE(draw_overview({}).empty());
  Overview one;
  one.cameras.emplace_back(0, 0, 0);
  EXPECT_GT(cv::countNonZero(pixels_of(draw_overview(one), kGreen)), 20);
}

TEST(Overview, IsWrittenAsAPicture) {
  TemporaryFolder folder;
  write_overview(folder / "overview.png", some_overview());
  const cv::Mat read = cv::imread(folder / "overview.png");
  EXPECT_EQ(cv::norm(read, draw_overview(some_overview()), cv::NORM_INF), 0);
  expect_error([&] { write_overview(folder / "no/overview.png", {}); }, {"no/overview.png"});
  expect_error([&] { write_overview(folder / "overview.txt", {}); }, {"overview.txt", "expected"});
}

TEST(Plot, RangesIgnoreTheGivenShares) {
  std::vector<double> values;
  for (int i = 0; i <= 100; ++i) values.push_back(100 - i);
  values.push_back(std::nan(""));
  const PlotRange range = range_of(values, 0.05, 0.1);
  EXPECT_EQ(range.low, 5);
  EXPECT_EQ(range.high, 90);
  const PlotRange point = with_margin(range_of({3, 3}), 0.05);
  EXPECT_LT(point.low, 3);
  EXPECT_GT(point.high, 3);
}

}  // namespace
}  // namespace mono_pose_tracker
