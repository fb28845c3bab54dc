#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <set>
#include <stdexcept>

#include "common/statistics.h"
#include "common/toolchain.h"
#include "features/sift_scale_space.h"
#include "mono_pose_tracker/features/sift.h"
#include "support/random_texture.h"

namespace mono_pose_tracker {
namespace {

bool same_bytes(const FeatureSet& a, const FeatureSet& b) {
  return a.size() == b.size() && cv::countNonZero(a.descriptors != b.descriptors) == 0 &&
         std::memcmp(a.features.data(), b.features.data(), a.features.size() * sizeof(Feature)) == 0;
}

FeatureSet extract(const SiftOptions& options, const cv::Mat& gray, const cv::Mat& mask = cv::Mat()) {
  FeatureSet set;
  make_sift_extractor(options)->extract(gray, mask, &set);
  return set;
}

// Median of (position in the image) + (position in the image turned by 180 degrees) - (width - 1, height - 1)
// over features that correspond: twice the bias of the localisation.
Eigen::Vector2f turn_bias(const SiftOptions& options, const cv::Mat& gray) {
  cv::Mat turned;
  cv::rotate(gray, turned, cv::ROTATE_180);
  const FeatureSet a = extract(options, gray);
  const FeatureSet b = extract(options, turned);
  const Eigen::Vector2f corner(gray.cols - 1.0f, gray.rows - 1.0f);
  std::vector<float> dx, dy;
  for (const Feature& f : a.features) {
    for (const Feature& g : b.features) {
      const Eigen::Vector2f d = f.pixel + g.pixel - corner;
      if (d.norm() > 1.0f || std::abs(f.scale / g.scale - 1.0f) > 0.05f) continue;
      dx.push_back(d.x());
      dy.push_back(d.y());
    }
  }
  EXPECT_GT(dx.size(), a.features.size() / 2);
  std::nth_element(dx.begin(), dx.begin() + dx.size() / 2, dx.end());
  std::nth_element(dy.begin(), dy.begin() + dy.size() / 2, dy.end());
  return {dx[dx.size() / 2], dy[dy.size() / 2]};
}

class SiftTest : public testing::TestWithParam<const char*> {
 protected:
  SiftOptions options() const {
    SiftOptions options;
    options.implementation = GetParam();
    options.sigma = 1.6f;
    options.contrast_threshold = 0.04f;
    return options;
  }
};

TEST(SiftOptionsTest, ValidateNamesTheKeyAtFault) {
  SiftOptions options;
  EXPECT_NO_THROW(options.validate());
  options.first_octave = 3;
  try {
    options.validate();
    FAIL() << "first_octave 3 was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "first_octave is 3, expected -1 to 2");
  }
  options = SiftOptions();
  options.contrast_threshold = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(options.validate(), std::invalid_argument);
  options = SiftOptions();
  options.implementation = "other";
  EXPECT_THROW(make_sift_extractor(options), std::invalid_argument);
}

TEST_P(SiftTest, HasNoBiasWhenTheImageIsTurned) {
  const Eigen::Vector2f bias = turn_bias(options(), random_texture(320, 240, 1));
  EXPECT_NEAR(bias.x(), 0.0f, 0.01f);
  EXPECT_NEAR(bias.y(), 0.0f, 0.01f);
}

TEST_P(SiftTest, IsOrderedByResponseAndRepeats) {
  const cv::Mat gray = random_texture(320, 240, 2);
  const FeatureSet first = extract(options(), gray);
  const auto extractor = make_sift_extractor(options());
  FeatureSet again;
  extractor->extract(random_texture(200, 300, 3), cv::Mat(), &again);
  extractor->extract(gray, cv::Mat(), &again);
  ASSERT_GT(first.size(), 100);
  EXPECT_TRUE(same_bytes(first, again));
  for (int i = 1; i < first.size(); ++i)
    EXPECT_GE(first.features[i - 1].response, first.features[i].response);
}

TEST_P(SiftTest, MaskHidesItsZeros) {
  const cv::Mat gray = random_texture(320, 240, 4);
  cv::Mat mask = cv::Mat::zeros(gray.size(), CV_8U);
  mask(cv::Rect(0, 0, 160, 240)).setTo(255);
  const FeatureSet all = extract(options(), gray);
  const FeatureSet left = extract(options(), gray, mask);
  const auto in_left = [](const Feature& f) { return f.pixel.x() < 159.5f; };
  EXPECT_TRUE(std::all_of(left.features.begin(), left.features.end(), in_left));
  EXPECT_EQ(left.size(), std::count_if(all.features.begin(), all.features.end(), in_left));
  EXPECT_GT(left.size(), 50);
}

TEST_P(SiftTest, BudgetIsKeptAndSpread) {
  // The left half has three times the contrast of the right: by strength alone the right would get little.
  cv::Mat gray = random_texture(640, 480, 5);
  cv::Mat right = gray(cv::Rect(320, 0, 320, 480));
  right.convertTo(right, CV_8U, 0.35, 80);
  SiftOptions limited = options();
  limited.max_features = 300;
  limited.contrast_threshold = 0.01f;
  const FeatureSet set = extract(limited, gray);
  EXPECT_EQ(set.size(), 300);
  EXPECT_EQ(set.descriptors.rows, 300);
  const auto in_right = std::count_if(set.features.begin(), set.features.end(),
                                      [](const Feature& f) { return f.pixel.x() > 320; });
  EXPECT_GT(in_right, 60);
  SiftOptions unlimited = limited;
  unlimited.max_features = 0;
  const FeatureSet all = extract(unlimited, gray);
  EXPECT_GT(all.size(), 300);
  EXPECT_EQ(set.features.front().response, all.features.front().response);
}

TEST_P(SiftTest, RootSiftIsTheSquareRoot) {
  const cv::Mat gray = random_texture(320, 240, 6);
  SiftOptions plain = options();
  plain.root_sift = false;
  const FeatureSet root = extract(options(), gray);
  const FeatureSet sift = extract(plain, gray);
  ASSERT_EQ(root.size(), sift.size());
  for (int i = 0; i < root.size(); ++i) {
    double sum = 0;
    for (int k = 0; k < 128; ++k) sum += sift.descriptor(i)[k];
    for (int k = 0; k < 128; ++k) {
      const double expected = 512.0 * std::sqrt(sift.descriptor(i)[k] / sum);
      // The plain descriptor was rounded to whole numbers: half a unit, seen through the square root.
      if (sift.descriptor(i)[k] <= 4 || expected >= 255) continue;
      EXPECT_NEAR(root.descriptor(i)[k], expected, 8.0);
    }
  }
}

TEST_P(SiftTest, ImagesWithoutFeaturesGiveNone) {
  EXPECT_EQ(extract(options(), cv::Mat(240, 320, CV_8U, cv::Scalar(100))).size(), 0);
  EXPECT_EQ(extract(options(), cv::Mat()).size(), 0);
  EXPECT_EQ(extract(options(), cv::Mat(1, 1, CV_8U, cv::Scalar(100))).size(), 0);
  EXPECT_EQ(extract(options(), cv::Mat(3, 200, CV_8U, cv::Scalar(7))).size(), 0);
  cv::Mat all_hidden = cv::Mat::zeros(240, 320, CV_8U);
  EXPECT_EQ(extract(options(), random_texture(320, 240, 7), all_hidden).size(), 0);
}

TEST(OwnSift, EndsWhenItIsCancelled) {
  std::atomic<bool> cancelled{false};
  SiftOptions options;
  options.cancelled = &cancelled;
  const auto extractor = make_sift_extractor(options);
  FeatureSet features;
  extractor->extract(random_texture(320, 240, 8), cv::Mat(), &features);
  EXPECT_GT(features.size(), 100);
  cancelled = true;
  extractor->extract(random_texture(320, 240, 8), cv::Mat(), &features);
  EXPECT_EQ(features.size(), 0);
  EXPECT_EQ(features.descriptors.rows, 0);
}

TEST_P(SiftTest, WrongImagesAreMisuse) {
  EXPECT_THROW(extract(options(), cv::Mat(24, 32, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(extract(options(), cv::Mat(24, 32, CV_8U), cv::Mat(24, 31, CV_8U)), std::invalid_argument);
}

struct Blob {
  Eigen::Vector2d centre;
  double sigma;
};

// Blobs of known centre and size, far enough apart not to move each other.
cv::Mat draw_blobs(const cv::Size& size, double smallest_sigma, double largest_sigma,
                   std::vector<Blob>* blobs) {
  Random random(8);
  const double spacing = 10 * largest_sigma;
  cv::Mat gray(size, CV_8U);
  for (double y = spacing / 2; y < gray.rows - spacing / 2; y += spacing) {
    for (double x = spacing / 2; x < gray.cols - spacing / 2; x += spacing) {
      blobs->push_back({{x + random.uniform(-1, 1), y + random.uniform(-1, 1)},
                        random.uniform(smallest_sigma, largest_sigma)});
    }
  }
  cv::Mat exact(gray.size(), CV_64F, cv::Scalar(60));
  for (const Blob& blob : *blobs) {
    const Eigen::Vector2i middle = blob.centre.cast<int>();
    const int reach = static_cast<int>(7 * blob.sigma);
    for (int y = std::max(middle.y() - reach, 0); y <= std::min(middle.y() + reach, gray.rows - 1); ++y) {
      for (int x = std::max(middle.x() - reach, 0); x <= std::min(middle.x() + reach, gray.cols - 1); ++x) {
        const double squared =
            (Eigen::Vector2d(x, y) - blob.centre).squaredNorm() / (blob.sigma * blob.sigma);
        exact.at<double>(y, x) += 150 * std::exp(-0.5 * squared);
      }
    }
  }
  exact.convertTo(gray, CV_8U);
  return gray;
}

class OwnSiftOctaveTest : public testing::TestWithParam<SiftScale> {
 protected:
  static SiftOptions octave_options() {
    SiftOptions options;
    options.first_octave = GetParam().first_octave;
    options.reduction = GetParam().reduction;
    return options;
  }
  static double pixel_size() { return GetParam().pixel_size(); }
};

TEST_P(OwnSiftOctaveTest, FindsBlobsWhereTheyAreAndAsLargeAsTheyAre) {
  SiftOptions options = octave_options();
  options.sigma = 1.2f;
  options.max_features = 0;
  const double pixel = pixel_size();
  std::vector<Blob> blobs;
  const int side = static_cast<int>(80 * std::max(pixel, 2.0));
  const cv::Size size(4 * side, 3 * side);  // with room for 30
  const cv::Mat gray = draw_blobs(size, 2.2 * pixel, 4.5 * pixel, &blobs);
  const FeatureSet set = extract(options, gray);
  ASSERT_GE(blobs.size(), 30u);
  int missed = 0;
  for (const Blob& blob : blobs) {
    const auto error = [&](const Feature& f) { return (f.pixel.cast<double>() - blob.centre).norm(); };
    const auto nearest =
        std::min_element(set.features.begin(), set.features.end(),
                         [&](const Feature& f, const Feature& g) { return error(f) < error(g); });
    ASSERT_NE(nearest, set.features.end());
    if (error(*nearest) > 1.0) {
      ++missed;
      continue;
    }
    EXPECT_LT(error(*nearest), 0.03 * std::max(pixel, 1.0));  // px
    // The difference of Gaussians k sigma and sigma answers a blob most where sigma = blob / sqrt(k).
    const double expected_scale = blob.sigma / std::sqrt(std::exp2(1.0 / options.octave_layers));
    EXPECT_NEAR(nearest->scale / expected_scale, 1.0, 0.03);
  }
  // Half-way between the last level of an octave and the first of the next, either may leave a blob to the
  // other.
  EXPECT_LE(missed, static_cast<int>(blobs.size()) / 100);
}

TEST_P(OwnSiftOctaveTest, ThreadsGiveTheSameBytesAsOne) {
  const int enlarged = pixel_size() > 2 ? 4 : 1;  // enough features
  const cv::Mat gray = random_texture(enlarged * 330, enlarged * 250, 9);
  SiftOptions options = octave_options();
  const FeatureSet one = extract(options, gray);
  options.num_threads = 3;
  const FeatureSet three = extract(options, gray);
  EXPECT_GT(one.size(), 20);
  EXPECT_TRUE(same_bytes(one, three));
}

TEST_P(OwnSiftOctaveTest, SizesOfAllKindsAreTaken) {
  SiftOptions options = octave_options();
  options.contrast_threshold = 0.0f;
  const auto extractor = make_sift_extractor(options);
  for (const cv::Size& size : {cv::Size(1, 1), cv::Size(2, 400), cv::Size(12, 12), cv::Size(13, 47),
                               cv::Size(400, 24), cv::Size(31, 33), cv::Size(257, 65), cv::Size(401, 301)}) {
    FeatureSet set;
    extractor->extract(random_texture(size.width, size.height, 10), cv::Mat(), &set);
    for (const Feature& f : set.features) {
      EXPECT_TRUE(f.pixel.x() >= 0 && f.pixel.y() >= 0 && f.pixel.x() < size.width &&
                  f.pixel.y() < size.height);
      EXPECT_TRUE(f.angle >= 0 && f.angle < 6.2832f);
      EXPECT_TRUE(std::isfinite(f.scale) && std::isfinite(f.response));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(FirstOctaves, OwnSiftOctaveTest,
                         testing::Values(SiftScale{-1, 1.6f}, SiftScale{0, 1.2f}, SiftScale{1, 1.0f},
                                         SiftScale{2, 1.0f}, SiftScale{0, 1.0f, 3}, SiftScale{0, 1.0f, 5},
                                         SiftScale{1, 1.0f, 3}));

// Mutually nearest features, a clear second best excluded (ratio 0.8), that lie within 1.5 px of where
// b_from_a says.
int count_right_matches(const FeatureSet& a, const FeatureSet& b, const cv::Matx23d& b_from_a) {
  const auto nearest = [](const FeatureSet& from, int i, const FeatureSet& to, double ratio) {
    double best = std::numeric_limits<double>::max(), second = best;
    int found = -1;
    for (int j = 0; j < to.size(); ++j) {
      const double d = cv::norm(from.descriptors.row(i), to.descriptors.row(j), cv::NORM_L2);
      if (d < best) found = j;
      second = std::min(second, std::max(d, best));
      best = std::min(best, d);
    }
    return best < ratio * second ? found : -1;
  };
  int right = 0;
  for (int i = 0; i < a.size(); ++i) {
    const int j = nearest(a, i, b, 0.8);
    if (j < 0 || nearest(b, j, a, 1.1) != i) continue;
    const Eigen::Vector2f p = a.features[i].pixel;
    const cv::Vec2d expected = b_from_a * cv::Vec3d(p.x(), p.y(), 1);
    right += std::hypot(b.features[j].pixel.x() - expected[0], b.features[j].pixel.y() - expected[1]) < 1.5;
  }
  return right;
}

TEST(OwnSiftTest, MatchesTurnedAndScaledImagesAsWellAsOpencv) {
#ifndef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
  GTEST_SKIP() << "this OpenCV has no SIFT";
#endif
  const cv::Mat gray = random_texture(360, 300, 11);
  const cv::Matx23d b_from_a = cv::Mat(cv::getRotationMatrix2D(cv::Point2f(180, 150), 37, 0.75));
  cv::Mat warped;
  cv::warpAffine(gray, warped, b_from_a, gray.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  SiftOptions options;
  options.first_octave = -1;
  options.sigma = 1.6f;
  options.max_features = 300;
  const int own = count_right_matches(extract(options, gray), extract(options, warped), b_from_a);
  options.implementation = "opencv";
  const int opencv = count_right_matches(extract(options, gray), extract(options, warped), b_from_a);
  EXPECT_GT(opencv, 60);
  EXPECT_GE(own, opencv);
}

TEST(OwnSiftTest, MinFeaturesLowersTheThresholdAsFarAsNeeded) {
  cv::Mat gray = random_texture(320, 240, 12);
  gray.convertTo(gray, CV_8U, 0.25, 100);
  SiftOptions options;
  options.contrast_threshold = 0.03f;
  options.min_features = 0;
  const FeatureSet few = extract(options, gray);
  options.min_features = 2 * few.size() + 40;
  const FeatureSet enough = extract(options, gray);
  EXPECT_GE(enough.size(), options.min_features);
  EXPECT_LT(enough.size(), 2 * options.min_features);
  for (const Feature& f : enough.features) EXPECT_GE(f.response * options.octave_layers, 0.25f * 0.03f);
}

// It keeps its images, and looks for weak features at once where it needed them the last time.
TEST(OwnSiftTest, WhatWasExtractedBeforeChangesNothing) {
  SiftOptions options;
  options.min_features = 300;
  SiftOptions without_weak = options;
  without_weak.min_features = 0;
  const auto extractor = make_sift_extractor(options);
  int poor = 0, rich = 0;
  for (int i = 0; i < 40; ++i) {
    cv::Mat gray = random_texture(320, 240, i);
    if (i / 2 % 2 == 1) gray.convertTo(gray, CV_8U, 0.25, 100);
    FeatureSet set;
    extractor->extract(gray, cv::Mat(), &set);
    EXPECT_TRUE(same_bytes(set, extract(options, gray))) << "image " << i;
    ++(extract(without_weak, gray).size() < options.min_features ? poor : rich);
  }
  EXPECT_GT(poor, 5);
  EXPECT_GT(rich, 5);
}

#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
INSTANTIATE_TEST_SUITE_P(Implementations, SiftTest, testing::Values("own", "opencv"));
#else
INSTANTIATE_TEST_SUITE_P(Implementations, SiftTest, testing::Values("own"));

TEST(OpencvSiftTest, IsRefusedWhereOpencvHasNone) {
  SiftOptions options;
  options.implementation = "opencv";
  EXPECT_THROW(make_sift_extractor(options), std::invalid_argument);
}
#endif

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
