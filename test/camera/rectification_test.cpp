#include "camera/camera_parameters.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

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
