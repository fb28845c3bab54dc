#include "camera/camera_parameters.h"

#include <gtest/gtest.h>

#include "support/plain_camera.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
