#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/statistics.h"
#include "io/plot.h"
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
    point.r = 220;
    overview.points.push_back(point);
  }
  for (int i = 0; i < 20; ++i) overview.cameras.emplace_back(0.1 * i, 0, 0);
  return overview;
}

enum Color { kRed, kGreen, kBlue };

/// Below title and legend.
cv::Mat panel_of(const cv::Mat& picture, int number) {
  const int legend = 120, half = picture.cols / 2;
  return picture(cv::Rect(number * half, legend, half, picture.rows - legend));
}

cv::Rect box_of(const cv::Mat& mask) {
  std::vector<cv::Point> pixels;
  cv::findNonZero(mask, pixels);
  return cv::boundingRect(pixels);
}

/// Pixels in which one channel stands out.
cv::Mat pixels_of(const cv::Mat& picture, Color color) {
  std::vector<cv::Mat> bgr;
  cv::split(picture, bgr);
  const int channel = color == kRed ? 2 : color == kGreen ? 1 : 0;
  cv::Mat rest = cv::max(bgr[(channel + 1) % 3], bgr[(channel + 2) % 3]), difference;
  cv::subtract(bgr[channel], rest, difference);
  return difference > 60;
}

TEST(Overview, PointsHaveTheirColourAndLieAheadOfTheCameras) {
  const cv::Mat picture = draw_overview(some_overview());
  ASSERT_EQ(picture.type(), CV_8UC3);
  const cv::Mat above = panel_of(picture, 0);
  EXPECT_GT(cv::countNonZero(pixels_of(above, kRed)), 500);
  const cv::Rect all = box_of(pixels_of(above, kRed) | pixels_of(above, kBlue));
  const cv::Rect start = box_of(pixels_of(above, kGreen));  // the camera's first place alone is green
  EXPECT_GT(start.y, all.y + 0.8 * all.height) << "z = 4 to 6 is forward of z = 0: higher in the picture";
  Overview without = some_overview();
  without.cameras.assign(2, {0, 0, 5});
  const cv::Rect cube = box_of(pixels_of(panel_of(draw_overview(without), 0), kRed));
  EXPECT_NEAR(cube.width, cube.height, 0.1 * cube.width) << "equal axes: a cube is a square";
}

TEST(Overview, BrightPointsCanBeSeenOnWhite) {
  Overview overview = some_overview();
  const cv::Mat before = draw_overview(overview);
  for (ColoredPoint& point : overview.points) point.r = point.g = point.b = 255;
  Overview none = overview;
  none.points.resize(1);
  const cv::Mat panel = panel_of(draw_overview(overview), 0);
  cv::Mat grey;
  cv::cvtColor(panel, grey, cv::COLOR_BGR2GRAY);
  EXPECT_GT(cv::countNonZero(grey < 205), 500 + cv::countNonZero(pixels_of(panel, kGreen)));
}

TEST(Overview, ThePathGoesFromBlueToRedFromStartToEnd) {
  Overview overview = some_overview();
  overview.points.clear();
  const cv::Mat above = panel_of(draw_overview(overview), 0);
  const cv::Rect blue = box_of(pixels_of(above, kBlue)), red = box_of(pixels_of(above, kRed)),
                 green = box_of(pixels_of(above, kGreen));
  EXPECT_LT(green.x, blue.x + blue.width / 2) << "the start is marked, at the left";
  EXPECT_LT(blue.x + blue.width, red.x + red.width);
  EXPECT_LT(blue.x, red.x) << "it goes to the right";
}

TEST(Overview, NoLineLeadsOverImagesWithoutAPose) {
  // Of the middle third of the panel: pixels that have a colour.
  const auto colored_between = [](const Overview& overview) {
    const cv::Mat above = panel_of(draw_overview(overview), 0);
    const cv::Mat middle = above.colRange(above.cols * 2 / 5, above.cols * 3 / 5);
    std::vector<cv::Mat> bgr;
    cv::split(middle, bgr);
    return cv::countNonZero(cv::abs(bgr[0] - bgr[1]) > 30);
  };
  Overview overview;
  for (const double begin : {0, 9}) {
    for (int i = 0; i < 10; ++i) overview.cameras.emplace_back(begin + 0.1 * i, 0, 0.05 * i);
  }
  EXPECT_GT(colored_between(overview), 100);
  overview.cameras.insert(overview.cameras.begin() + 10, no_camera());
  EXPECT_EQ(colored_between(overview), 0);
}

TEST(Overview, TheSideViewShowsTheLongestWay) {
  // A walk to the right: seen along z it is a line as long as the panel, seen along x it would be a dot.
  Overview overview;
  for (int i = 0; i < 50; ++i) overview.cameras.emplace_back(0.2 * i, 0, 0.01 * (i % 2));
  const cv::Mat side = panel_of(draw_overview(overview), 1);
  EXPECT_GT(box_of(pixels_of(side, kBlue) | pixels_of(side, kRed)).width, 0.7 * side.cols);
  // A drive ahead: forward is to the right.
  overview.cameras.clear();
  for (int i = 0; i < 50; ++i) overview.cameras.emplace_back(0, 0, 0.2 * i);
  const cv::Mat drive = panel_of(draw_overview(overview), 1);
  EXPECT_LT(box_of(pixels_of(drive, kBlue)).x, box_of(pixels_of(drive, kRed)).x);
  EXPECT_GT(box_of(pixels_of(drive, kBlue) | pixels_of(drive, kRed)).width, 0.7 * drive.cols);
}

TEST(Overview, SaysWhatItsLengthsAreIn) {
  Overview overview = some_overview();
  const cv::Mat in_map_units = draw_overview(overview);
  overview.unit = "m";
  cv::Mat difference = draw_overview(overview) != in_map_units;
  const cv::Mat last_line = difference.rowRange(difference.rows - 40, difference.rows);
  EXPECT_GT(cv::countNonZero(last_line.reshape(1)), 100);
  EXPECT_EQ(cv::countNonZero(difference.reshape(1)), cv::countNonZero(last_line.reshape(1)));
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

TEST(Overview, ASkylineDoesNotMakeAWalkADot) {
  Overview overview;
  for (int i = 0; i < 50; ++i) overview.cameras.emplace_back(0.2 * i, 0, 0);
  ColoredPoint point;
  for (int i = 0; i < 300; ++i) {
    const float a = 0.37f * static_cast<float>(i);
    point.x_in_map = {5 + 9 * std::cos(a), std::sin(3 * a), 4 * std::sin(a)};  // what is near
    overview.points.push_back(point);
    point.x_in_map = {5 + 400 * std::cos(a), -20, 400 * std::sin(a)};  // what is on the horizon
    overview.points.push_back(point);
  }
  const cv::Mat above = panel_of(draw_overview(overview), 0);
  EXPECT_GT(box_of(pixels_of(above, kBlue) | pixels_of(above, kRed)).width, 0.2 * above.cols);
}

TEST(Overview, TheTruthShowsBelowAPathThatIsRight) {
  Overview overview = some_overview();
  overview.points.clear();
  const auto black = [](const cv::Mat& picture) {
    cv::Mat grey;
    cv::cvtColor(panel_of(picture, 0), grey, cv::COLOR_BGR2GRAY);
    return cv::countNonZero(grey < 20);
  };
  const int before = black(draw_overview(overview));
  overview.true_cameras = overview.cameras;
  EXPECT_GT(black(draw_overview(overview)), before + 200);
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
