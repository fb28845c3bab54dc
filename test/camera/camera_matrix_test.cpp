#include "camera/camera_parameters.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

TEST(CameraMatrix, RoundingIsNoSkew) {
  EXPECT_EQ(require_camera_matrix({500, 0, 320, 0, 510, 240, 0, 0, 1}, 480), "");
  EXPECT_EQ(require_camera_matrix({500, 9e-4, 320, -9e-4, 510, 240, 1e-6, -1e-6, 1 + 1e-6}, 480), "");
}

// At row 0, 240 rows from the centre, a skew of 1 px moves pixels by 240 / 480 px.
TEST(CameraMatrix, ASkewThatHardlyMovesPixelsIsIgnored) {
  const auto with_skew = [](double skew, double cy) {
    return std::array<double, 9>{500, skew, 320, 0, 480, cy, 0, 0, 1};
  };
  EXPECT_NE(require_camera_matrix(with_skew(-0.05, 240), 480).find("-0.05 px"), std::string::npos);
  EXPECT_NE(require_camera_matrix(with_skew(0.99, 240), 480), "");
  EXPECT_NE(require_camera_matrix(with_skew(0.9, 240), 240), "") << "the farthest row is 240 rows away";
  for (const auto& [skew, cy] : {std::pair(1.01, 240.0), {0.99, 100.0}, {-1.01, 240.0}, {0.1, 5000.0}}) {
    try {
      require_camera_matrix(with_skew(skew, cy), 480);
      FAIL() << "accepted: " << skew << ", " << cy;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("--fisheye-fix-skew"), std::string::npos) << error.what();
    }
  }
}

TEST(CameraMatrix, OtherFormsAreRefused) {
  for (const auto& [place, value] : {std::pair(1, 5.0), std::pair(3, -0.5), std::pair(6, 1e-3),
                                     std::pair(7, 1e-3), std::pair(8, 0.0), std::pair(8, 2.0)}) {
    std::array<double, 9> matrix = {500, 0, 320, 0, 510, 240, 0, 0, 1};
    matrix[static_cast<std::size_t>(place)] = value;
    EXPECT_THROW(require_camera_matrix(matrix, 480), std::invalid_argument) << place;
    matrix[static_cast<std::size_t>(place)] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(require_camera_matrix(matrix, 480), std::invalid_argument) << place;
  }
}

}  // namespace
}  // namespace mono_pose_tracker
