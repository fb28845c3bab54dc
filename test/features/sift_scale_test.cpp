#include "mono_pose_tracker/features/sift_scale.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

SiftScale live_scale(int width, int height) {
  return choose_sift_scale(SiftOptions(), {width, height}, kWholeImage, SearchPace::kLive);
}

int recording_octave(int width, int height, double object_px = kWholeImage) {
  return choose_sift_scale(SiftOptions(), {width, height}, object_px).first_octave;
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

TEST(SiftScaleTest, ASmallObjectIsSearchedFiner) {
  EXPECT_EQ(recording_octave(512, 512, 200), -1);
  EXPECT_EQ(recording_octave(512, 512, 512), 0);
  EXPECT_EQ(recording_octave(3840, 2160, 200), -1);
  EXPECT_EQ(recording_octave(512, 512, 1e6), 0) << "no object is larger than the image";
  // Live, the whole image is blurred all the same.
  const auto live = [](const cv::Size& size) {
    return choose_sift_scale(SiftOptions(), size, 100, SearchPace::kLive).first_octave;
  };
  EXPECT_EQ(live({640, 480}), 0);
  EXPECT_EQ(live({320, 240}), -1);
  EXPECT_EQ(live({1920, 1080}), 0);
}

TEST(SiftScaleTest, ExplicitValuesWin) {
  SiftOptions options;
  options.first_octave = -1;
  EXPECT_EQ(choose_sift_scale(options, {3840, 2160}, kWholeImage, SearchPace::kLive).first_octave, -1);
  EXPECT_FLOAT_EQ(choose_sift_scale(options, {640, 480}).sigma, 1.6f);
  options.sigma = 2.0f;
  EXPECT_FLOAT_EQ(choose_sift_scale(options, {640, 480}).sigma, 2.0f);
  options.first_octave.reset();
  const SiftScale scale = choose_sift_scale(options, {1920, 1080}, kWholeImage, SearchPace::kLive);
  EXPECT_EQ(scale.reduction, 3);
  EXPECT_FLOAT_EQ(scale.sigma, 2.0f);
  options.first_octave = 1;
  EXPECT_EQ(choose_sift_scale(options, {1920, 1080}, kWholeImage, SearchPace::kLive).reduction, 1);
}

TEST(SiftScaleTest, LiveALargeImageIsSearchedByMoreThreads) {
  const auto threads = [](const cv::Size& size, SearchPace pace, int cores, int chosen = 0) {
    SiftOptions options;
    options.num_threads = chosen;
    return choose_sift_threads(options, choose_sift_scale(options, size, kWholeImage, pace), size, pace,
                               cores);
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
