#include "io/grey_levels.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "io/image_decoding.h"

namespace mono_pose_tracker {
namespace {

/// Values from one to the other, all equally frequent.
cv::Mat ramp(int first, int last, int type = CV_16UC1) {
  cv::Mat image(64, 64, type);
  for (int i = 0; i < 4096; ++i) {
    const int value = first + (last - first) * i / 4095;
    for (int c = 0; c < image.channels(); ++c) image.ptr<std::uint16_t>(i / 64, i % 64)[c] = value;
  }
  return image;
}

GreyLevels chosen(const cv::Mat& image) {
  GreyLevelChoice choice;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(choice.look_at(image), i == 4);
  EXPECT_TRUE(choice.is_settled());
  return choice.levels();
}

TEST(GreyLevels, AutoTakesTheBitsThatTheFirstImagesUse) {
  for (const auto& [bits, most] : {std::pair(10, 1000), {12, 4080}, {14, 16000}, {16, 65280}, {12, 1024}}) {
    for (const int type : {CV_16UC1, CV_16UC3}) {
      const GreyLevels levels = chosen(ramp(0, most, type));
      EXPECT_EQ(levels.black, 0);
      EXPECT_EQ(levels.white, 1 << bits) << most;
    }
  }
}

// Radiometric counts of a thermal camera.
TEST(GreyLevels, ANarrowRangeIsStretched) {
  const GreyLevels levels = chosen(ramp(7400, 8165));
  EXPECT_GT(levels.black, 6900);
  EXPECT_LT(levels.black, 7400);
  EXPECT_GT(levels.white, 8165);
  EXPECT_LT(levels.white, 8700);
}

TEST(GreyLevels, BlackImagesAtTheStartTellNothing) {
  GreyLevelChoice choice;
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(choice.look_at(ramp(0, 60)));
  for (int i = 0; i < 5; ++i) choice.look_at(ramp(0, 4000));
  EXPECT_TRUE(choice.is_settled());
  EXPECT_EQ(choice.levels().white, 4096);
  EXPECT_NE(choice.text().find("4096 to white"), std::string::npos) << choice.text();
  choice.look_at(ramp(0, 60000));
  EXPECT_EQ(choice.levels().white, 4096) << "grey must not change with the content";
}

TEST(GreyLevels, AreAsTheyAreSet) {
  EXPECT_EQ(GreyLevelChoice("10").levels().white, 1024);
  const GreyLevelChoice set("7000:9000");
  EXPECT_TRUE(set.is_settled());
  EXPECT_EQ(set.levels().black, 7000);
  EXPECT_EQ(set.levels().white, 9000);
  for (const char* wrong : {"", "7", "17", "9000:7000", "a", "0:70000", "12.5", "1:2:3"}) {
    EXPECT_THROW(GreyLevelChoice{wrong}, std::invalid_argument) << wrong;
  }
}

TEST(GreyLevels, OfEightBitsNothingIsChosen) {
  GreyLevelChoice choice;
  EXPECT_FALSE(choice.look_at(cv::Mat(4, 4, CV_8UC1, cv::Scalar(9))));
  EXPECT_EQ(choice.text(), "");
}

TEST(GreyLevels, MakeImagesOfEightBits) {
  const cv::Mat image(2, 2, CV_16UC1, cv::Scalar(2048));
  EXPECT_EQ(to_8_bit(image).image.at<uchar>(0, 0), 8);
  EXPECT_EQ(to_8_bit(image, {0, 4096}).image.at<uchar>(0, 0), 128);
  EXPECT_EQ(to_8_bit(image, {2000, 2096}).image.at<uchar>(0, 0), 128);
  EXPECT_EQ(to_8_bit(image, {3000, 4096}).image.at<uchar>(0, 0), 0);
  EXPECT_EQ(to_8_bit(image, {0, 1024}).image.at<uchar>(0, 0), 255);
}

}  // namespace
}  // namespace mono_pose_tracker
