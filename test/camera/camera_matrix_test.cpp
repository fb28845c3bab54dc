#include "mono_pose_tracker/camera/camera_matrix.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

TEST(CameraMatrix, RoundingIsNoSkew) {
  EXPECT_NO_THROW(require_camera_matrix({500, 0, 320, 0, 510, 240, 0, 0, 1}));
  EXPECT_NO_THROW(require_camera_matrix({500, 9e-4, 320, -9e-4, 510, 240, 1e-6, -1e-6, 1 + 1e-6}));
}

TEST(CameraMatrix, OtherFormsAreRefused) {
  for (const auto& [place, value] : {std::pair(1, 0.5), std::pair(3, -0.5), std::pair(6, 1e-3),
                                     std::pair(7, 1e-3), std::pair(8, 0.0), std::pair(8, 2.0)}) {
    std::array<double, 9> matrix = {500, 0, 320, 0, 510, 240, 0, 0, 1};
    matrix[static_cast<std::size_t>(place)] = value;
    EXPECT_THROW(require_camera_matrix(matrix), std::invalid_argument) << place;
    matrix[static_cast<std::size_t>(place)] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(require_camera_matrix(matrix), std::invalid_argument) << place;
  }
}

}  // namespace
}  // namespace mono_pose_tracker
