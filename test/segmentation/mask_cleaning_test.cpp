#include "segmentation/object_outline.h"

#include <gtest/gtest.h>

#include "segmentation/object_images.h"

namespace mono_pose_tracker {
namespace {

TEST(CleanMask, SpecksGoHolesAreFilledGapsClose) {
  const cv::Mat truth = ellipse_mask({320, 240}, {160, 120});
  cv::Mat raw = truth.clone();
  cv::circle(raw, {160, 120}, 12, 0, cv::FILLED);                       // a hole
  cv::line(raw, {100, 150}, {220, 150}, 0, 3);                          // a gap that cuts it in two
  for (int x = 5; x < 320; x += 20) raw.at<std::uint8_t>(10, x) = 255;  // specks
  EXPECT_GT(overlap(clean_mask(raw, 1, 4, 1, 100), truth), 0.98);
}

TEST(CleanMask, KeepsTheLargestComponentsOfEnoughArea) {
  cv::Mat raw = cv::Mat::zeros(100, 200, CV_8UC1);
  raw(cv::Rect(10, 10, 40, 40)) = 255;
  raw(cv::Rect(80, 10, 30, 30)) = 255;
  raw(cv::Rect(150, 10, 10, 10)) = 255;
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 1, 50)), 1600);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 2, 50)), 2500);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 50)), 2600);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 200)), 2500);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 5000)), 0);
}

TEST(CleanMask, AnObjectThatTheBorderCutsStaysWhole) {
  cv::Mat raw = cv::Mat::zeros(100, 200, CV_8UC1);
  raw(cv::Rect(60, 40, 80, 60)) = 255;  // down to the lower border
  EXPECT_GT(overlap(clean_mask(raw, 2, 4, 1, 100), raw), 0.99);
}

TEST(Clearance, AFeatureKeepsMarginAndScalesFromTheEdge) {
  cv::Mat mask(41, 101, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 20) = 0;  // the edge: column 19 is the last outside
  const cv::Mat clearance = clearance_of(mask, 3, 2, 8);
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 10), 0);
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 22), 0);        // 3 px from column 19
  EXPECT_NEAR(clearance.at<std::uint8_t>(20, 26), 16, 1);  // 4 px of room: a scale of 2 px
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 100), 255);     // the image's border is no edge
}

TEST(Clearance, WithoutMarginTheWholeMaskIsOpen) {
  const cv::Mat mask = ellipse_mask({320, 240}, {160, 120});
  EXPECT_EQ(cv::countNonZero(clearance_of(mask, 0, 0, 8) != mask), 0);
}

}  // namespace
}  // namespace mono_pose_tracker
