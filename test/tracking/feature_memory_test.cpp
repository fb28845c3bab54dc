#include "tracking/feature_memory.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

ImageFeaturesPtr some_features() { return std::make_shared<ImageFeatures>(); }

cv::Mat mask_of(int value) { return {4, 6, CV_8UC1, cv::Scalar(value)}; }

TEST(FeatureMemory, KnowsAnImageByWhatItsFeaturesHangOn) {
  FeatureMemory memory;
  SiftOptions sift;
  const ImageFeaturesPtr features = some_features();
  memory.keep(3, sift, mask_of(255), features);
  EXPECT_EQ(memory.find(3, sift, mask_of(255)), features);
  EXPECT_EQ(memory.find(2, sift, mask_of(255)), nullptr);
  EXPECT_EQ(memory.find(3, sift, mask_of(8)), nullptr);
  EXPECT_EQ(memory.find(3, sift, cv::Mat()), nullptr);
  sift.num_threads = 4;  // gives the same features
  EXPECT_EQ(memory.find(3, sift, mask_of(255)), features);
  sift.max_features *= 2;
  EXPECT_EQ(memory.find(3, sift, mask_of(255)), nullptr);
}

TEST(FeatureMemory, KeepsTheLastTwoOfAnImage) {
  FeatureMemory memory;
  const SiftOptions sift;
  const ImageFeaturesPtr whole = some_features(), first = some_features(), second = some_features();
  memory.keep(0, sift, cv::Mat(), whole);
  memory.keep(0, sift, mask_of(1), first);
  EXPECT_EQ(memory.find(0, sift, cv::Mat()), whole);
  EXPECT_EQ(memory.find(0, sift, mask_of(1)), first);
  memory.keep(0, sift, mask_of(2), second);
  EXPECT_EQ(memory.find(0, sift, cv::Mat()), nullptr);
  EXPECT_EQ(memory.find(0, sift, mask_of(1)), first);
  EXPECT_EQ(memory.find(0, sift, mask_of(2)), second);
}

// Half of the features, by an extractor that was cancelled.
TEST(FeatureMemory, WhatWasBrokenOffIsNotKept) {
  FeatureMemory memory;
  std::atomic<bool> cancelled{true};
  SiftOptions sift;
  sift.cancelled = &cancelled;
  memory.keep(0, sift, cv::Mat(), some_features());
  EXPECT_EQ(memory.find(0, sift, cv::Mat()), nullptr);
}

TEST(FeatureMemory, IsNotWithoutBounds) {
  FeatureMemory memory;
  const SiftOptions sift;
  const cv::Mat large(4096, 4096, CV_8UC1, cv::Scalar(255));  // 16 MB
  int kept = 0;
  for (int i = 0; i < 40; ++i) memory.keep(i, sift, large, some_features());
  for (int i = 0; i < 40; ++i) kept += memory.find(i, sift, large) != nullptr;
  EXPECT_GE(kept, 10);
  EXPECT_LE(kept, 16);
}

}  // namespace
}  // namespace mono_pose_tracker
