#include "mapping/projection_matcher.h"

#include <gtest/gtest.h>

#include <numeric>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kWidth = 640, kHeight = 480, kMinInliers = 15;

// A feature each 20 px, row by row.
ImageFeatures grid() {
  ImageFeatures image;
  image.camera = synthetic_camera();
  for (int y = 10; y < kHeight; y += 20) {
    for (int x = 10; x < kWidth; x += 20) {
      Feature feature;
      feature.pixel = Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y));
      image.set.features.push_back(feature);
    }
  }
  return image;
}

// From near, all landmarks in view are expected.
ExpectedFinds near(double expected) { return {static_cast<int>(expected), expected}; }

// Every n-th feature is an inlier.
PoseSupport one_in(int n, const ExpectedFinds& in_map) {
  const ImageFeatures image = grid();
  std::vector<int> inliers;
  for (int f = 0; f < image.size(); f += n) inliers.push_back(f);
  return pose_support(image, inliers, in_map);
}

// The inliers are in the first rows.
PoseSupport first_rows(int rows) {
  std::vector<int> inliers(static_cast<std::size_t>(rows) * kWidth / 20);
  std::iota(inliers.begin(), inliers.end(), 0);
  return pose_support(grid(), inliers, near(static_cast<double>(inliers.size())));
}

TEST(PoseSupport, OneOfFourThatAreToBeExpectedIsEnoughOneOfSevenIsNot) {
  EXPECT_TRUE(is_supported(one_in(9, near(4 * 86)), kMinInliers));
  EXPECT_FALSE(is_supported(one_in(9, near(7 * 86)), kMinInliers)) << "768 features could show 768 of them";
}

TEST(PoseSupport, ManyFindsWhereFewAreExpectedAreAliased) {
  EXPECT_FALSE(is_supported(one_in(9, near(4)), kMinInliers)) << "from behind";
}

TEST(PoseSupport, AtObliqueViewsLittleIsFoundAndNoMoreThanExpected) {
  EXPECT_TRUE(is_supported(one_in(9, {700, 100}), kMinInliers)) << "86 of 700, of which 100 can be known";
  EXPECT_FALSE(is_supported(one_in(9, {700, 20}), kMinInliers)) << "another side that looks like it";
  EXPECT_TRUE(is_supported(one_in(9, {300, 20}), kMinInliers)) << "what looks the same from far beside";
}

// A map from many views of an object has three times as many landmarks in view as one image has features.
TEST(PoseSupport, NoMoreLandmarksThanTheImageHasFeaturesCanBeFound) {
  EXPECT_TRUE(is_supported(one_in(4, near(3 * 768)), kMinInliers));
  EXPECT_FALSE(is_supported(one_in(10, near(3 * 768)), kMinInliers));
}

TEST(PoseSupport, OfAFewFeaturesThirtyAreAskedFor) {
  PoseSupport support{20, near(400), 0.5, 80};
  EXPECT_FALSE(is_supported(support, kMinInliers));
  support.found = 30;
  EXPECT_TRUE(is_supported(support, kMinInliers));
}

TEST(PoseSupport, FewInliersAreNone) {
  EXPECT_TRUE(is_supported(one_in(50, near(16)), kMinInliers));
  EXPECT_FALSE(is_supported(one_in(60, near(13)), kMinInliers));
}

TEST(PoseSupport, APartOfTheImageIsNoneHoweverManyItHolds) {
  EXPECT_FALSE(is_supported(first_rows(4), kMinInliers)) << "of 24";
  EXPECT_TRUE(is_supported(first_rows(9), kMinInliers));
}

TEST(PoseSupport, HangsInACorner) {
  const ImageFeatures image = grid();
  EXPECT_TRUE(is_confined_to_corner(pose_support(image, {0, 1, 2, 3, 4, 5}, near(6))));
  EXPECT_FALSE(is_confined_to_corner(first_rows(4))) << "a sixth of the image";
}

}  // namespace
}  // namespace mono_pose_tracker
