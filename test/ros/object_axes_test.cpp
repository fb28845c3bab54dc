#include "ros/debug_image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../support/plain_camera.h"

namespace mono_pose_tracker {
namespace {

TEST(ObjectAxes, AreWhereTheCameraSeesThem) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  const auto axes = project_axes(plain_camera(), Rigid3(quarter, {0.1, 0.2, 2}), 0.4);
  ASSERT_TRUE(axes);
  EXPECT_NEAR((axes->origin_px - Eigen::Vector2d(345, 290)).norm(), 0, 1e-9);
  EXPECT_NEAR((axes->tips_px[0] - Eigen::Vector2d(345, 390)).norm(), 0, 1e-9) << "x points down";
  EXPECT_NEAR((axes->tips_px[1] - Eigen::Vector2d(245, 290)).norm(), 0, 1e-9) << "y to the left";
  EXPECT_NEAR((axes->tips_px[2] - Eigen::Vector2d(320 + 50 / 2.4, 240 + 100 / 2.4)).norm(), 0, 1e-9)
      << "z away from the camera";
}

TEST(ObjectAxes, AreNotSeenBehindTheCamera) {
  EXPECT_FALSE(project_axes(plain_camera(), Rigid3(Eigen::Quaterniond::Identity(), {0, 0, -1}), 0.4));
  const Eigen::Quaterniond towards(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(project_axes(plain_camera(), Rigid3(towards, {0, 0, 0.3}), 0.4)) << "z reaches past it";
}

}  // namespace
}  // namespace mono_pose_tracker
