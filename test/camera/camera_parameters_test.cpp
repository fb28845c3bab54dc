#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "camera/camera_parameters.h"
#include "support/synthetic_views.h"

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

CameraParameters distorting_camera() {
  CameraParameters camera = plain_camera().parameters();
  camera.distortion = {-0.2, 0.05, 0, 0, 0};
  return camera;
}

TEST(SameCamera, WhatMovesNoPixelIsRounding) {
  const CameraParameters camera = distorting_camera();
  CameraParameters rounded = camera;
  rounded.fx += 1e-4;
  rounded.cy -= 1e-4;
  rounded.distortion[1] += 1e-9;
  EXPECT_TRUE(is_same_camera(camera, camera));
  EXPECT_TRUE(is_same_camera(camera, rounded));
  EXPECT_TRUE(is_same_camera(rounded, camera));
}

TEST(SameCamera, WhatMovesOneIsNot) {
  const CameraParameters camera = distorting_camera();
  const auto expect_other = [&](void (*change)(CameraParameters*)) {
    CameraParameters other = camera;
    change(&other);
    EXPECT_FALSE(is_same_camera(camera, other));
    EXPECT_FALSE(is_same_camera(other, camera));
  };
  expect_other([](CameraParameters* other) { other->fx += 0.01; });
  expect_other([](CameraParameters* other) { other->cx += 0.01; });
  expect_other([](CameraParameters* other) { other->distortion[1] += 1e-4; });  // in the corners
  expect_other([](CameraParameters* other) { other->width += 1; });
}

TEST(SameCamera, AChangeThatCostsLittleIsTolerated) {
  const CameraParameters camera = distorting_camera();
  CameraParameters other = camera;
  other.cx += 0.15;
  EXPECT_FALSE(is_same_camera(camera, other));
  EXPECT_TRUE(is_same_camera(camera, other, kToleratedCalibrationChangePx));
  other.cx += 0.1;
  EXPECT_FALSE(is_same_camera(camera, other, kToleratedCalibrationChangePx));
}

TEST(SameCamera, AModelThatDistortsNothingIsNone) {
  CameraParameters camera = distorting_camera(), other = camera;
  camera.distortion.clear();
  other.distortion_model = "rational_polynomial";
  other.distortion.assign(8, 0.0);
  EXPECT_TRUE(is_same_camera(camera, other));
}

TEST(SizeMismatch, NamesBothSizesTheirOriginAndTheLikelyCause) {
  const std::string text = size_mismatch_text(480, 640, 640, 480, "image_width and image_height of a.yaml");
  for (const char* part : {"is 480x640", "for 640x480", "of a.yaml", "swapped", "orientation tag"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  EXPECT_NE(size_mismatch_text(1280, 480, 640, 480, "").find("side by side"), std::string::npos);
  EXPECT_NE(size_mismatch_text(640, 960, 640, 480, "").find("one above the other"), std::string::npos);
  EXPECT_NE(size_mismatch_text(320, 240, 640, 480, "").find("0.5 times"), std::string::npos);
  EXPECT_NE(size_mismatch_text(320, 240, 640, 480, "").find("correct the stated size and binning"),
            std::string::npos);
  EXPECT_EQ(size_mismatch_text(600, 480, 640, 480, ""), "is 600x480, the calibration is for 640x480");
}

bool is_rectified(const std::string& topic) { return decide_rectification("auto", topic).is_rectified; }

TEST(Rectification, AutoGoesByTheBaseNameOfTheTopic) {
  for (const char* topic : {"/camera/image_rect", "image_rect", "/left/image_rect_color", "/image_rect_raw",
                            "/camera/image_rect/compressed", "camera/image_rect_color/theora"}) {
    EXPECT_TRUE(is_rectified(topic)) << topic;
    EXPECT_NE(decide_rectification("auto", topic).reason.find(topic), std::string::npos);
  }
  for (const char* topic : {"/camera/image_raw", "/image_rect/image_raw", "/camera/image_raw/compressed", "",
                            "/rect/image", "/camera/my_image_rect", "compressed", "/"}) {
    EXPECT_FALSE(is_rectified(topic)) << topic;
  }
}

TEST(Rectification, AValueThatIsSetWins) {
  EXPECT_TRUE(decide_rectification("true", "/camera/image_raw").is_rectified);
  EXPECT_FALSE(decide_rectification("false", "/camera/image_rect").is_rectified);
  EXPECT_TRUE(decide_rectification("true", "").is_rectified);
  EXPECT_NE(decide_rectification("true", "").reason.find("set to true"), std::string::npos);
}

TEST(Rectification, AContradictionIsNamedWhereItMatters) {
  EXPECT_NE(rectification_contradiction("true", "/camera/image_raw", true).find("/camera/image_raw"),
            std::string::npos);
  EXPECT_NE(rectification_contradiction("true", "/camera/image_color/compressed", true), "");
  EXPECT_NE(rectification_contradiction("false", "/camera/image_rect", true), "");
  EXPECT_EQ(rectification_contradiction("true", "/camera/image_raw", false), "") << "both are the same";
  EXPECT_EQ(rectification_contradiction("true", "/camera/image", true), "") << "a name that says nothing";
  EXPECT_EQ(rectification_contradiction("true", "/camera/image_rect", true), "");
  EXPECT_EQ(rectification_contradiction("auto", "/camera/image_raw", true), "");
  EXPECT_EQ(rectification_contradiction("true", "", true), "") << "files have no topic";
}

}  // namespace

}  // namespace mono_pose_tracker
