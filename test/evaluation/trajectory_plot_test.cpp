#include "evaluation/trajectory_plot.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

TrajectoryError two_lines(double distance) {
  TrajectoryError error;
  for (int i = 0; i < 10; ++i)
    error.positions.push_back({i * 1000000000ll, {1.0 * i, 0, 0}, {1.0 * i, 0, distance}});
  error.position_max = distance;
  return error;
}

TEST(TrajectoryPlot, ShowsBothAndTheirDistance) {
  TemporaryFolder folder;
  write_trajectory_plot(folder / "plot.png", two_lines(0.5));
  const cv::Mat apart = cv::imread(folder / "plot.png");
  ASSERT_FALSE(apart.empty());
  EXPECT_EQ(cv::norm(apart, draw_trajectory_plot(two_lines(0.5)), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(apart, draw_trajectory_plot(two_lines(0.1)), cv::NORM_INF), 50);
}

TEST(TrajectoryPlot, NoErrorAtAllIsAPictureToo) { EXPECT_FALSE(draw_trajectory_plot(two_lines(0)).empty()); }

TEST(TrajectoryPlot, NoTitleIsCut) {
  TrajectoryError error = two_lines(0.5);
  error.position_rmse = 0.000590721;
  error.position_rmse_percent = 0.0543;
  const cv::Mat picture = draw_trajectory_plot(error);
  // The titles' line of the lower two diagrams: nothing is drawn where one ends and the other begins.
  cv::Mat ink;
  cv::inRange(picture(cv::Rect(680, 700, 40, 40)), cv::Scalar::all(0), cv::Scalar::all(128), ink);
  EXPECT_EQ(cv::countNonZero(ink), 0);
}

TEST(TrajectoryPlot, SaysWhenItCannotWrite) {
  expect_error([&] { write_trajectory_plot("/no/such/folder/plot.png", two_lines(1)); },
               {"/no/such/folder/plot.png"});
}

}  // namespace
}  // namespace mono_pose_tracker
