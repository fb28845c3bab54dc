#include "tracking/background_image.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

SegmentationOptions with_image(const std::string& path) {
  SegmentationOptions options;
  options.method = "background";
  options.background_image = path;
  return options;
}

TEST(BackgroundImage, IsReadInColours) {
  const TemporaryFolder folder;
  cv::imwrite(folder / "grey.png", cv::Mat(20, 30, CV_8UC1, cv::Scalar(77)));
  const cv::Mat image = read_background_image(with_image(folder / "grey.png"));
  ASSERT_EQ(image.type(), CV_8UC3);
  EXPECT_EQ(image.at<cv::Vec3b>(3, 4), cv::Vec3b(77, 77, 77));
}

TEST(BackgroundImage, IsReadForItsMethodOnly) {
  SegmentationOptions options = with_image("/nowhere/background.png");
  options.method = "chroma";
  EXPECT_TRUE(read_background_image(options).empty());
  EXPECT_TRUE(read_background_image(with_image("")).empty());
}

TEST(BackgroundImage, IsRefusedByNameWhenItCannotBeRead) {
  expect_error<std::invalid_argument>([] { read_background_image(with_image("/nowhere/background.png")); },
                                      {"segmentation/background_image = /nowhere/background.png"});
}

// libjpeg fills in missing data.
TEST(BackgroundImage, IsRefusedWhenItIsCut) {
  const TemporaryFolder folder;
  cv::Mat noise(240, 320, CV_8UC3);
  cv::randu(noise, cv::Scalar::all(0), cv::Scalar::all(256));
  cv::imwrite(folder / "whole.jpg", noise);
  const std::string whole = folder.read("whole.jpg");
  folder.write("cut.jpg", whole.substr(0, whole.size() / 2));
  EXPECT_FALSE(read_background_image(with_image(folder / "whole.jpg")).empty());
  expect_error<std::invalid_argument>([&] { read_background_image(with_image(folder / "cut.jpg")); },
                                      {"cut.jpg"});
}

}  // namespace
}  // namespace mono_pose_tracker
