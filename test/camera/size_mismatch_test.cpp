#include "camera/camera_parameters.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(SizeMismatch, NamesBothSizesTheirOriginAndTheLikelyCause) {
  const std::string text = size_mismatch_text(480, 640, 640, 480, "image_width and image_height of a.yaml");
  for (const char* part : {"is 480x640", "for 640x480", "of a.yaml", "swapped", "orientation tag"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  EXPECT_NE(size_mismatch_text(1280, 480, 640, 480, "").find("side by side"), std::string::npos);
  EXPECT_NE(size_mismatch_text(640, 960, 640, 480, "").find("one above the other"), std::string::npos);
  EXPECT_NE(size_mismatch_text(320, 240, 640, 480, "").find("0.5 times"), std::string::npos);
  EXPECT_EQ(size_mismatch_text(600, 480, 640, 480, ""), "is 600x480, the calibration is for 640x480");
}

}  // namespace
}  // namespace mono_pose_tracker
