#include "mono_pose_tracker/camera/camera_model.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(ImageScale, IsTheSameHoweverThePhoneIsHeld) {
  EXPECT_DOUBLE_EQ(image_scale(1920, 1080), 3);
  EXPECT_DOUBLE_EQ(image_scale(1080, 1920), 3);
}

TEST(ImageScale, DescriptorsHaveTheirSizeInPxHoweverSmallTheImageIs) {
  EXPECT_DOUBLE_EQ(image_scale(640, 480), 1);
  EXPECT_DOUBLE_EQ(image_scale(320, 240), 1);
}

}  // namespace
}  // namespace mono_pose_tracker
