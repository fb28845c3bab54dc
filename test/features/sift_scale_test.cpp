#include "features/sift_scale_space.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

SiftScale live_scale(int width, int height) {
  return choose_sift_scale(SiftOptions(), {width, height}, SearchPace::kLive);
}

TEST(SiftScaleTest, LiveALargeImageIsReducedToWhatOneThreadSearches) {
  EXPECT_EQ(live_scale(320, 240).reduction, 1);
  EXPECT_EQ(live_scale(640, 480).reduction, 1);
  EXPECT_EQ(live_scale(752, 480).reduction, 1);
  EXPECT_EQ(live_scale(1024, 576).reduction, 1);
  EXPECT_EQ(live_scale(1280, 720).reduction, 2);
  EXPECT_EQ(live_scale(1920, 1080).reduction, 3);
  EXPECT_EQ(live_scale(3840, 2160).reduction, 5);
  for (int width = 64; width <= 8192; width += 64) {
    const SiftScale scale = live_scale(width, width);
    EXPECT_EQ(scale.first_octave, 0);
    const double side = static_cast<double>(width) / scale.reduction;
    EXPECT_LE(side, scale.reduction == 1 ? 784 : 620) << width;
    EXPECT_GE(side, scale.reduction == 1 ? 64 : 390) << width;
    EXPECT_GE(scale.reduction, live_scale(width - 63, width - 63).reduction) << width;
  }
}

TEST(SiftScaleTest, ARecordingIsSearchedInFull) {
  for (const int width : {64, 640, 1920, 3840}) {
    EXPECT_EQ(choose_sift_scale(SiftOptions(), {width, width * 3 / 4}), SiftScale()) << width;
  }
}

TEST(SiftScaleTest, FinerHalvesTheReductionOrTakesTheOctaveBefore) {
  EXPECT_EQ(finer({0, 1.0f, 5}), (SiftScale{0, 1.0f, 3}));
  EXPECT_EQ(finer({0, 1.0f, 2}), (SiftScale{0, 1.2f, 1}));
  EXPECT_EQ(finer({0, 1.2f, 1}), (SiftScale{-1, 1.6f, 1}));
  EXPECT_EQ(finer({-1, 1.6f, 1}), (SiftScale{-1, 1.6f, 1}));
}

TEST(SiftScaleTest, AnObjectIsSmallInThePixelsThatAreSearched) {
  EXPECT_TRUE(is_small_object(200, SiftScale()));
  EXPECT_FALSE(is_small_object(300, SiftScale()));
  EXPECT_TRUE(is_small_object(600, {0, 1.0f, 3}));
  EXPECT_FALSE(is_small_object(0, {0, 1.0f, 3})) << "there is none";
}

TEST(SiftScaleTest, ExplicitValuesWin) {
  SiftOptions options;
  options.first_octave = -1;
  EXPECT_EQ(choose_sift_scale(options, {3840, 2160}, SearchPace::kLive).first_octave, -1);
  EXPECT_FLOAT_EQ(choose_sift_scale(options, {640, 480}).sigma, 1.6f);
  options.sigma = 2.0f;
  EXPECT_FLOAT_EQ(choose_sift_scale(options, {640, 480}).sigma, 2.0f);
  options.first_octave.reset();
  const SiftScale scale = choose_sift_scale(options, {1920, 1080}, SearchPace::kLive);
  EXPECT_EQ(scale.reduction, 3);
  EXPECT_FLOAT_EQ(scale.sigma, 2.0f);
  options.first_octave = 1;
  EXPECT_EQ(choose_sift_scale(options, {1920, 1080}, SearchPace::kLive).reduction, 1);
}

TEST(SiftScaleTest, LiveALargeImageIsSearchedByMoreThreads) {
  const auto threads = [](const cv::Size& size, SearchPace pace, int cores, int chosen = 0) {
    SiftOptions options;
    options.num_threads = chosen;
    return choose_sift_threads(options, choose_sift_scale(options, size, pace), size, pace, cores);
  };
  EXPECT_EQ(threads({640, 480}, SearchPace::kLive, 4), 1);
  EXPECT_EQ(threads({752, 480}, SearchPace::kLive, 4), 1);
  EXPECT_EQ(threads({1024, 576}, SearchPace::kLive, 4), 2);
  EXPECT_EQ(threads({1024, 576}, SearchPace::kLive, 1), 1);
  EXPECT_EQ(threads({1024, 576}, SearchPace::kLive, 0), 1) << "not known how many there are";
  EXPECT_EQ(threads({1024, 576}, SearchPace::kRecording, 4), 1);
  EXPECT_EQ(threads({1280, 720}, SearchPace::kLive, 4), 1) << "it is reduced";
  EXPECT_EQ(threads({1920, 1080}, SearchPace::kLive, 4), 1) << "it is reduced";
  EXPECT_EQ(threads({3840, 2160}, SearchPace::kLive, 4), 2) << "to read it takes long";
  EXPECT_EQ(threads({640, 480}, SearchPace::kLive, 2, 3), 3) << "it was chosen";
}

TEST(SiftScaleTest, FeaturesArePixelsOfTheirOctaveButNeverFinerThanTheImage) {
  EXPECT_EQ(feature_pixel_size({-1, 1.6f}), 1);
  EXPECT_EQ(feature_pixel_size({0, 1.2f}), 1);
  EXPECT_EQ(feature_pixel_size({2, 1.0f}), 4);
  EXPECT_EQ(feature_pixel_size({1, 1.0f, 3}), 6);
}

}  // namespace
}  // namespace mono_pose_tracker
