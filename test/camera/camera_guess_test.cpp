#include "camera/camera_parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

TEST(CameraGuess, SeesTheGivenAngleFromEdgeToEdge) {
  const CameraModel camera(guess_camera(640, 480, 70));
  const Eigen::Vector3d left = camera.bearing({-0.5, 239.5}), right = camera.bearing({639.5, 239.5});
  EXPECT_NEAR(std::acos(left.dot(right)) * 180 / M_PI, 70, 1e-9);
  EXPECT_NEAR(camera.bearing({319.5, 239.5}).z(), 1, 1e-12);
  EXPECT_EQ(camera.parameters().fx, camera.parameters().fy);
}

TEST(CameraGuess, RefusesWhatIsNoFieldOfView) {
  for (const double hfov : {0.0, -60.0, 180.0, std::nan("")}) {
    EXPECT_THROW(guess_camera(640, 480, hfov), std::invalid_argument) << hfov;
  }
  EXPECT_THROW(guess_camera(0, 480, 60), std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
