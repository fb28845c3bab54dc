#include "tracking/occlusion.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

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
  EXPECT_EQ(features_to_map(image, landmarks, 1), (std::vector<char>{1, 0}));
}

TEST(FeaturesToMap, ExcludesFeaturesFarFromAllLandmarks) {
  const ImageFeatures image = features_at({{100, 100}, {600, 400}});
  EXPECT_EQ(features_to_map(image, {{{100, 100}, true}}, 1), (std::vector<char>{1, 0}));
  EXPECT_EQ(features_to_map(image, {}, 1), (std::vector<char>{0, 0}));
}

// Landmarks at one place, with this number of found ones.
std::vector<ExpectedLandmark> landmarks_at(double x, double y, int count, int found) {
  std::vector<ExpectedLandmark> landmarks;
  for (int i = 0; i < count; ++i) landmarks.push_back({{x + i, y}, i < found});
  return landmarks;
}

std::vector<ExpectedLandmark> both(std::vector<ExpectedLandmark> a, const std::vector<ExpectedLandmark>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A hand in front of the object: an accidental match or two among the many landmarks that it occludes do not
// make it the object.
TEST(FeaturesToMap, ExcludesFeaturesThatHideLandmarks) {
  const std::vector<ExpectedLandmark> object = landmarks_at(100, 200, 30, 20);
  const ImageFeatures hand = features_at({{310, 205}});
  for (const bool given : {false, true}) {
    EXPECT_EQ(features_to_map(hand, both(object, landmarks_at(300, 200, 20, 2)), 1, given),
              std::vector<char>{0});
    EXPECT_EQ(features_to_map(hand, both(object, landmarks_at(300, 200, 20, 14)), 1, given),
              std::vector<char>{1});
  }
}

TEST(FeaturesToMap, AfterALargeStepFewAreFoundOnTheObjectItself) {
  const ImageFeatures image = features_at({{310, 205}});
  const std::vector<ExpectedLandmark> object = landmarks_at(100, 200, 60, 6);
  const std::vector<ExpectedLandmark> landmarks = both(object, landmarks_at(300, 200, 20, 1));
  EXPECT_EQ(features_to_map(image, landmarks, 1, true), std::vector<char>{1});
  EXPECT_EQ(features_to_map(image, landmarks, 1, false), std::vector<char>{0}) << "it may be a hand";
}

// None of several occluded landmarks is found: that is evidence, unlike with one or two.
TEST(FeaturesToMap, WhatAGivenMaskHoldsIsOfTheObjectUnlessItHidesLandmarks) {
  const ImageFeatures image = features_at({{600, 400}, {310, 205}});
  const std::vector<ExpectedLandmark> object = landmarks_at(100, 200, 30, 20);
  EXPECT_EQ(features_to_map(image, both(object, landmarks_at(300, 200, 2, 0)), 1, true),
            (std::vector<char>{1, 1}));
  EXPECT_EQ(features_to_map(image, both(object, landmarks_at(300, 200, 8, 0)), 1, true),
            (std::vector<char>{1, 0}));
}

TEST(FeaturesToMap, ItsReachGrowsWithTheImage) {
  const ImageFeatures image = features_at({{100, 100}});
  const std::vector<ExpectedLandmark> landmarks = {{{160, 100}, true}};
  EXPECT_EQ(features_to_map(image, landmarks, 1), std::vector<char>{0});
  EXPECT_EQ(features_to_map(image, landmarks, 2), std::vector<char>{1})
      << "the same angle at twice the width";
}

/// An image with features at these pixels; each descriptor's first byte is its feature's number.
ImageFeaturesPtr image_at(const std::vector<Eigen::Vector2f>& pixels) {
  FeatureSet set;
  set.descriptors = cv::Mat::zeros(static_cast<int>(pixels.size()), 128, CV_8U);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    Feature feature;
    feature.pixel = pixels[i];
    feature.scale = 2;
    set.features.push_back(feature);
    set.descriptors.at<std::uint8_t>(static_cast<int>(i), 0) = static_cast<std::uint8_t>(i);
  }
  return make_image_features(set, cv::Mat::zeros(480, 640, CV_8UC1), plain_camera());
}

/// A plate 2 units from the camera of the map's keyframe 7, with a landmark every 20 px from (200, 150) to
/// (440, 330), and a candidate that has moved sideways.
class ExcludeOccluders : public ::testing::Test {
 protected:
  void SetUp() override {
    KeyframeView reference;
    reference.id = 7;
    for (int y = 150; y <= 330; y += 20) {
      for (int x = 200; x <= 440; x += 20) {
        const LandmarkId id = 100 + static_cast<LandmarkId>(reference.landmark_of_feature.size());
        map_.landmarks.set(id, Eigen::Vector3d((x - 320) / 250.0, (y - 240) / 250.0, 2));
        reference.landmark_of_feature.push_back(id);
      }
    }
    map_.keyframes.set(7, reference);
    candidate_.reference = 7;
  }

  Eigen::Vector2d pixel_of(LandmarkId id) const {
    Eigen::Vector2d pixel;
    EXPECT_TRUE(plain_camera().project(camera_from_map_ * map_.landmarks.at(id), &pixel));
    return pixel;
  }

  /// Sets the candidate's features: the landmarks except where the hand is, then the others.
  void see(const cv::Rect2d& hand, const std::vector<Eigen::Vector2f>& others) {
    std::vector<Eigen::Vector2f> pixels;
    for (const LandmarkId id : map_.keyframes.at(7).landmark_of_feature) {
      if (map_.landmarks.count(id) == 0) continue;
      const Eigen::Vector2d pixel = pixel_of(id);
      if (hand.contains({pixel.x(), pixel.y()})) continue;
      candidate_.observations.push_back({static_cast<int>(pixels.size()), id});
      pixels.push_back(pixel.cast<float>());
    }
    first_other_ = static_cast<int>(pixels.size());
    pixels.insert(pixels.end(), others.begin(), others.end());
    candidate_.frame.image = image_at(pixels);
  }

  /// The others that are left, by their index in the list given to see.
  std::vector<int> others_left() {
    exclude_occluders(map_, plain_camera(), camera_from_map_, &candidate_);
    const FeatureSet& set = candidate_.frame.image->set;
    std::vector<int> left;
    for (int i = 0; i < set.size(); ++i) {
      const int number = *set.descriptor(i);
      if (number >= first_other_) left.push_back(number - first_other_);
    }
    return left;
  }

  TrackingMap map_;
  KeyframeCandidate candidate_;
  const Rigid3 camera_from_map_{Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0, 0)};  // 25 px
  int first_other_ = 0;
};

TEST_F(ExcludeOccluders, KeepsWhatIsNewOnTheObjectAndNothingOfAHandOrOfWhatIsBehindIt) {
  const cv::Rect2d hand(330, 140, 150, 210);
  see(hand, {{255, 205}, {275, 325}, {400, 200}, {420, 300}, {60, 60}, {600, 440}});
  EXPECT_EQ(others_left(), (std::vector<int>{0, 1}));
}

TEST_F(ExcludeOccluders, AGivenMaskIsTrustedButForTheHandInIt) {
  candidate_.frame.is_mask_given = true;
  see(cv::Rect2d(330, 140, 150, 210), {{255, 205}, {400, 200}, {60, 60}});
  EXPECT_EQ(others_left(), (std::vector<int>{0, 2}));
}

TEST_F(ExcludeOccluders, AHandBeforeMostOfTheObjectIsExcluded) {
  candidate_.frame.is_mask_given = true;
  see(cv::Rect2d(265, 140, 220, 210), {{235, 205}, {400, 200}});  // three columns of thirteen are visible
  EXPECT_EQ(others_left(), std::vector<int>{0});
}

TEST_F(ExcludeOccluders, KeepsEveryObservationWithItsFeature) {
  see(cv::Rect2d(330, 140, 150, 210), {{255, 205}, {400, 200}, {275, 325}});
  // An accidental match within the hand is left to the map.
  const LandmarkId hidden = map_.keyframes.at(7).landmark_of_feature[61];  // behind it
  ASSERT_TRUE(cv::Rect2d(360, 200, 90, 90).contains({pixel_of(hidden).x(), pixel_of(hidden).y()}));
  candidate_.observations.push_back({first_other_ + 1, hidden});
  const std::vector<FrameObservation> before = candidate_.observations;
  const ImageFeaturesPtr image_before = candidate_.frame.image;
  EXPECT_EQ(others_left(), (std::vector<int>{0, 1, 2}));
  const ImageFeatures& image = *candidate_.frame.image;
  ASSERT_EQ(candidate_.observations.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const FrameObservation& o = candidate_.observations[i];
    EXPECT_EQ(o.landmark, before[i].landmark);
    ASSERT_LT(o.feature, image.size());
    EXPECT_EQ(image.set.features[o.feature].pixel, image_before->set.features[before[i].feature].pixel);
    EXPECT_EQ(*image.set.descriptor(o.feature), *image_before->set.descriptor(before[i].feature));
  }
}

TEST_F(ExcludeOccluders, WhatCannotBeSeenIsNotExpected) {
  const std::vector<LandmarkId> all = map_.keyframes.at(7).landmark_of_feature;
  // Around a found landmark, some landmarks have left the map and the others are behind the camera.
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == 61) continue;
    if (i % 2 == 0) map_.landmarks.erase(all[i]);
    if (i % 2 == 1) map_.landmarks.set(all[i], {0, 0, -2});
  }
  const Eigen::Vector2d found = pixel_of(all[61]);
  const Eigen::Vector2f nearby = found.cast<float>() + Eigen::Vector2f(8, 5);
  candidate_.observations = {{0, all[61]}};
  candidate_.frame.image = image_at({found.cast<float>(), nearby, {60, 60}});
  first_other_ = 1;
  EXPECT_EQ(others_left(), std::vector<int>{0});
}

TEST_F(ExcludeOccluders, WithoutOcclusionOnlyFeaturesFarFromTheObjectAreExcluded) {
  see({}, {{230, 160}, {340, 250}, {460, 330}, {560, 330}});
  EXPECT_EQ(others_left(), (std::vector<int>{0, 1, 2}));
}

}  // namespace
}  // namespace mono_pose_tracker
