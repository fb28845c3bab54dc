#include "tracking/occlusion.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

/// An image with features at these pixels.
ImageFeatures features_at(const std::vector<Eigen::Vector2f>& pixels) {
  ImageFeatures image;
  for (const Eigen::Vector2f& pixel : pixels) {
    Feature feature;
    feature.pixel = pixel;
    image.set.features.push_back(feature);
  }
  return image;
}

TEST(FeaturesToMap, GrowsNearWhatWasFound) {
  const ImageFeatures image = features_at({{100, 100}, {400, 300}});
  const std::vector<ExpectedLandmark> landmarks = {{{110, 95}, true}, {{90, 120}, true}, {{405, 310}, false}};
  EXPECT_EQ(features_to_map(image, landmarks, 640), (std::vector<char>{1, 0}));
}

TEST(FeaturesToMap, LeavesOutWhatIsFarFromAllLandmarks) {
  const ImageFeatures image = features_at({{100, 100}, {600, 400}});
  EXPECT_EQ(features_to_map(image, {{{100, 100}, true}}, 640), (std::vector<char>{1, 0}));
  EXPECT_EQ(features_to_map(image, {}, 640), (std::vector<char>{0, 0}));
}

// A hand before the object: a chance match or two among the many landmarks that it hides make no object of
// it.
TEST(FeaturesToMap, LeavesOutWhatHidesLandmarks) {
  std::vector<ExpectedLandmark> landmarks;
  for (int i = 0; i < 20; ++i) landmarks.push_back({{300.0 + i, 200.0}, i < 2});
  const ImageFeatures hand = features_at({{310, 205}});
  EXPECT_EQ(features_to_map(hand, landmarks, 640), std::vector<char>{0});
  for (int i = 0; i < 14; ++i) landmarks[i].found = true;  // two of three, as on the object itself
  EXPECT_EQ(features_to_map(hand, landmarks, 640), std::vector<char>{1});
}

TEST(FeaturesToMap, ItsReachGrowsWithTheImage) {
  const ImageFeatures image = features_at({{100, 100}});
  const std::vector<ExpectedLandmark> landmarks = {{{160, 100}, true}};
  EXPECT_EQ(features_to_map(image, landmarks, 640), std::vector<char>{0});
  EXPECT_EQ(features_to_map(image, landmarks, 1280), std::vector<char>{1})
      << "the same angle at twice the width";
  EXPECT_EQ(features_to_map(features_at({{100, 100}}), {{{130, 100}, true}}, 320), std::vector<char>{1})
      << "descriptors have their size in px, however narrow the image is";
}

}  // namespace
}  // namespace mono_pose_tracker
