#include "camera/distortion.h"

#include <gtest/gtest.h>

#include <vector>

namespace mono_pose_tracker {
namespace {

std::vector<CameraParameters> calibrated_cameras() {
  CameraParameters plain;
  plain.width = 640, plain.height = 480;
  plain.fx = 500, plain.fy = 510, plain.cx = 310, plain.cy = 245;
  std::vector<CameraParameters> result = {plain, plain, plain, plain};
  result[1].distortion = {-0.2, 0.05, 0.001, -0.002, 0.01};
  result[2].distortion_model = "rational_polynomial";
  result[2].distortion = {0.3, 0.1, 0.001, -0.002, 0.01, 0.4, 0.12, 0.02};
  result[3].distortion_model = "equidistant";
  result[3].distortion = {0.02, -0.01, 0.003, -0.001};
  return result;
}

const CalibrationStep& step() {
  static const CalibrationStep step = (CalibrationStep() << 0.05, 3, -2, 0.01, -0.004).finished();
  return step;
}

TEST(CalibratingCamera, ProjectsAsTheCameraItHasBecome) {
  for (const CameraParameters& start : calibrated_cameras()) {
    const CalibratingCamera calibrating(start);
    const CameraModel moved(calibrating.moved(step()));
    EXPECT_NEAR(moved.parameters().fx / start.fx, moved.parameters().fy / start.fy, 1e-12);
    for (const Eigen::Vector3d& x : {Eigen::Vector3d(0.3, -0.2, 1), Eigen::Vector3d(0, 0, 2)}) {
      Eigen::Vector2d pixel, expected;
      Eigen::Matrix<double, 2, 3> by_point, expected_by_point;
      Eigen::Matrix<double, 2, kCalibrationParameters> by_step;
      ASSERT_TRUE(calibrating.project(step(), x, &pixel, &by_point, &by_step));
      ASSERT_TRUE(moved.project(x, &expected, &expected_by_point));
      EXPECT_LT((pixel - expected).norm(), 1e-9) << start.distortion_model;
      EXPECT_LT((by_point - expected_by_point).norm(), 1e-8) << start.distortion_model;
    }
  }
}

TEST(CalibratingCamera, KnowsHowPixelsFollow) {
  for (const CameraParameters& start : calibrated_cameras()) {
    const CalibratingCamera calibrating(start);
    const Eigen::Vector3d x(0.3, -0.2, 1);
    Eigen::Vector2d pixel, low, high;
    Eigen::Matrix<double, 2, 3> by_point;
    Eigen::Matrix<double, 2, kCalibrationParameters> by_step, unused;
    ASSERT_TRUE(calibrating.project(step(), x, &pixel, &by_point, &by_step));
    for (int i = 0; i < kCalibrationParameters; ++i) {
      CalibrationStep small = CalibrationStep::Zero();
      small[i] = 1e-5;
      calibrating.project(step() - small, x, &low, &by_point, &unused);
      calibrating.project(step() + small, x, &high, &by_point, &unused);
      EXPECT_LT(((high - low) / 2e-5 - by_step.col(i)).norm(), 1e-4 * (1 + by_step.col(i).norm()))
          << start.distortion_model << ' ' << i;
    }
  }
}

TEST(CalibratingCamera, BeginsWithoutAModelWhateverItsZeros) {
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = p.fy = 500;
  p.cx = 319.5;
  p.cy = 239.5;
  p.distortion_model = "";
  p.distortion.assign(14, 0);
  const CameraParameters moved = CalibratingCamera(p).moved(CalibrationStep::Zero());
  EXPECT_EQ(moved.distortion_model, "plumb_bob");
  EXPECT_EQ(moved.distortion, std::vector<double>(5, 0));
}

TEST(CalibratingCamera, SeesNothingBehindIt) {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kCalibrationParameters> by_step;
  EXPECT_FALSE(CalibratingCamera(calibrated_cameras()[0])
                   .project(CalibrationStep::Zero(), {0.1, 0, -1}, &pixel, &by_point, &by_step));
}

}  // namespace
}  // namespace mono_pose_tracker
