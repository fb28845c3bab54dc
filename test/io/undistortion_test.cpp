#include "io/undistortion.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {
namespace {

CameraModel distorted_camera() {
  CameraParameters parameters;
  parameters.width = 320;
  parameters.height = 240;
  parameters.fx = parameters.fy = 250;
  parameters.cx = 158;
  parameters.cy = 121;
  parameters.distortion = {-0.28, 0.07, 0.001, -0.0005, 0};
  return CameraModel(parameters);
}

TEST(Undistorter, ABlobComesToLieWhereItsRayMeetsThePinholeImage) {
  const CameraModel camera = distorted_camera();
  const Undistorter undistorter(camera);
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(60, 50), Eigen::Vector2d(270, 190), Eigen::Vector2d(158, 121)}) {
    cv::Mat image = cv::Mat::zeros(240, 320, CV_8UC1);
    cv::circle(image, cv::Point(static_cast<int>(at.x()), static_cast<int>(at.y())), 3, 255, cv::FILLED);
    const cv::Moments m = cv::moments(undistorter.image(image));
    const Eigen::Vector3d ray = camera.bearing(at);
    const Eigen::Vector2d expected(250 * ray.x() / ray.z() + 158, 250 * ray.y() / ray.z() + 121 - 3);
    EXPECT_NEAR(m.m10 / m.m00, expected.x(), 0.2);
    EXPECT_NEAR(m.m01 / m.m00, expected.y(), 0.2);
    EXPECT_LT((undistorter.pixel(at) - expected).norm(), 1e-6);
  }
}

TEST(Undistorter, TheCameraHasItsPrincipalPointInTheMiddleAndNoDistortion) {
  const Undistorter undistorter(distorted_camera());
  const CameraParameters& camera = undistorter.camera();
  EXPECT_EQ(camera.fx, 250);
  EXPECT_EQ(camera.width, 317);
  EXPECT_EQ(camera.height, 237);
  EXPECT_EQ(camera.cx, 158);
  EXPECT_EQ(camera.cy, 118);
  for (const double k : camera.distortion) EXPECT_EQ(k, 0);
}

TEST(Undistorter, WithoutDistortionPixelsKeepTheirValues) {
  CameraParameters parameters = distorted_camera().parameters();
  parameters.distortion.clear();
  parameters.cx = 172.3;
  parameters.cy = 100.1;
  const Undistorter undistorter((CameraModel(parameters)));
  const CameraParameters& camera = undistorter.camera();
  EXPECT_NEAR(camera.cx + 0.5, 0.5 * camera.width, 0.25);
  EXPECT_NEAR(camera.cy + 0.5, 0.5 * camera.height, 0.25);
  cv::Mat image(240, 320, CV_8UC1);
  cv::randu(image, 0, 256);
  const cv::Mat expected = image(cv::Rect(320 - camera.width, 0, camera.width, camera.height));
  EXPECT_EQ(cv::countNonZero(undistorter.image(image) != expected), 0);
}

TEST(Undistorter, APrincipalPointOutsideTheImageStays) {
  CameraParameters parameters = distorted_camera().parameters();
  parameters.cx = -20;
  const Undistorter undistorter((CameraModel(parameters)));
  EXPECT_EQ(undistorter.camera().width, 320);
  EXPECT_EQ(undistorter.camera().cx, -20);
}

TEST(Undistorter, MasksStayTwoValuedAndNoMaskIsTheWholeImage) {
  const Undistorter undistorter(distorted_camera());
  cv::Mat mask = cv::Mat::zeros(240, 320, CV_8UC1);
  mask.colRange(0, 160) = 255;
  const cv::Mat half = undistorter.mask(mask), whole = undistorter.mask(cv::Mat());
  EXPECT_EQ(cv::countNonZero((half != 0) & (half != 255)), 0);
  EXPECT_GT(cv::countNonZero(half), 0.45 * 320 * 240);
  EXPECT_LT(cv::countNonZero(half), 0.55 * 320 * 240);
  EXPECT_GT(cv::countNonZero(whole), 0.95 * 320 * 240);
}

}  // namespace
}  // namespace mono_pose_tracker
