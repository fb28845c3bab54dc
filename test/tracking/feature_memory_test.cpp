#include "tracking/feature_memory.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "support/synthetic_views.h"
#include "support/temporary_folder.h"

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

ImageFeaturesPtr random_features(int count, const CameraModel& camera) {
  cv::RNG random(count);
  cv::Mat image(camera.height(), camera.width(), CV_8UC3);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  FeatureSet set;
  set.descriptors.create(count, 128, CV_8U);
  random.fill(set.descriptors, cv::RNG::UNIFORM, 0, 255);
  for (int i = 0; i < count; ++i) {
    set.features.push_back({{random.uniform(0.f, 600.f), random.uniform(0.f, 400.f)},
                            random.uniform(1.f, 9.f),
                            random.uniform(-3.f, 3.f),
                            random.uniform(0.f, 1.f)});
  }
  return make_image_features(std::move(set), image, camera);
}

void expect_same_bits(const ImageFeatures& a, const ImageFeatures& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(cv::norm(a.set.descriptors, b.set.descriptors, cv::NORM_INF), 0);
  EXPECT_EQ(a.sigma_px, b.sigma_px);
  EXPECT_EQ(a.color_rgb, b.color_rgb);
  for (int i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.set.bearings[i], b.set.bearings[i]);
    EXPECT_EQ(a.pixel_from_bearing[i], b.pixel_from_bearing[i]);
    const Feature &f = a.set.features[i], &g = b.set.features[i];
    EXPECT_EQ(f.pixel, g.pixel);
    EXPECT_EQ(std::tie(f.scale, f.angle, f.response), std::tie(g.scale, g.angle, g.response));
  }
  std::vector<int> near_a, near_b;
  a.grid.visit_near({300, 200}, 50, [&](int i) { near_a.push_back(i); });
  b.grid.visit_near({300, 200}, 50, [&](int i) { near_b.push_back(i); });
  EXPECT_EQ(near_a, near_b);
}

TEST(FeatureMemory, WhatDoesNotFitIntoMemoryIsReadFromAFileWithTheSameBits) {
  const CameraModel camera = plain_camera();
  TemporaryFolder folder;
  FeatureMemoryOptions options;
  options.memory_bytes = 0;
  options.folder = folder.path();
  FeatureMemory memory(options);
  const SiftOptions sift;
  const std::vector<ImageFeaturesPtr> features = {random_features(50, camera), random_features(200, camera)};
  for (int i = 0; i < 2; ++i) memory.keep(i, sift, mask_of(i), features[i]);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()))
      << "nothing is left behind by a process that is killed";
  for (const int i : {1, 0, 1}) {
    const ImageFeaturesPtr found = memory.find(i, sift, mask_of(i));
    ASSERT_TRUE(found);
    EXPECT_NE(found, features[i]) << "it does not hold the memory";
    expect_same_bits(*found, *features[i]);
  }
}

TEST(FeatureMemory, IsNotWithoutBounds) {
  const CameraModel camera = plain_camera();
  const ImageFeaturesPtr features = random_features(100, camera);
  const auto kept_with = [&](const FeatureMemoryOptions& options) {
    FeatureMemory memory(options);
    const SiftOptions sift;
    int kept = 0;
    for (int i = 0; i < 40; ++i) memory.keep(i, sift, mask_of(1), features);
    for (int i = 0; i < 40; ++i) kept += memory.find(i, sift, mask_of(1)) != nullptr;
    return kept;
  };
  FeatureMemoryOptions options;
  EXPECT_EQ(kept_with(options), 40);
  options.memory_bytes = 100'000;  // 4 images
  EXPECT_EQ(kept_with(options), 40);
  options.file_bytes = 160'000;  // 10 images
  EXPECT_EQ(kept_with(options), 14);
  options.folder = "/none";
  EXPECT_EQ(kept_with(options), 4);
}

TEST(SeenImages, AShortRecordingIsKeptWhole) {
  const auto image = std::make_shared<const ImageFeatures>();
  SeenImages seen;
  for (int i = 0; i < static_cast<int>(SeenImages::kMost); ++i) seen.add(i, image);
  for (int i = 0; i < static_cast<int>(SeenImages::kMost); ++i) EXPECT_EQ(seen.find(i), image) << i;
  EXPECT_EQ(seen.find(-1), nullptr);
}

TEST(SeenImages, OfALongOneTheyAreFromAllAlongIt) {
  constexpr int kImages = 3600, kParts = 10, kPart = kImages / kParts;
  const auto image = std::make_shared<const ImageFeatures>();
  SeenImages seen;
  for (int i = 0; i < kImages; ++i) seen.add(i, image);
  int kept = 0;
  for (int part = 0; part < kParts; ++part) {
    int of_part = 0;
    for (int i = part * kPart; i < (part + 1) * kPart; ++i) of_part += seen.find(i) != nullptr;
    EXPECT_NEAR(of_part, kPart / 16, 1) << "tenth " << part;
    kept += of_part;
  }
  EXPECT_LE(kept, static_cast<int>(SeenImages::kMost));
  seen.add(1, image);
  EXPECT_EQ(seen.find(1), nullptr) << "registered again";
}

}  // namespace
}  // namespace mono_pose_tracker
