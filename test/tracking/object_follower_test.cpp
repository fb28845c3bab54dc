#include "tracking/object_follower.h"

#include <gtest/gtest.h>

#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

// A head next to a room, separated from it in the first image.
class ObjectFollowerTest : public testing::Test, protected TwoObjects {
 protected:
  ObjectFollowerTest() : map_(map_with(true, 120, 200, {7, 0, 10})), follower_(start()) {}

  TurningObject start() const {
    TurningObject object;
    object.image = map_.keyframe(0)->image;
    for (int f = 0; f < object.image->size(); ++f) {
      object.sides.push_back(f < head_features(0) ? FeatureMotion::kTurns : FeatureMotion::kMovesOtherwise);
    }
    return object;
  }

  Frame frame(int k) const {
    Frame frame;
    frame.image = map_.keyframe(k)->image;
    return frame;
  }

  int room_features(int k) const { return frame(k).image->size() - head_features(k); }

  // Number of remaining features of the head in keyframe k, and of the room.
  std::pair<int, int> kept(const Frame& of_object, int k) const {
    std::pair<int, int> kept;
    const std::vector<Feature>& all = frame(k).image->set.features;
    for (const Feature& feature : of_object.image->set.features) {
      int f = 0;
      while (all[f].pixel != feature.pixel) ++f;
      (f < head_features(k) ? kept.first : kept.second) += 1;
    }
    return kept;
  }

  Map map_;
  ObjectFollower follower_;
};

TEST_F(ObjectFollowerTest, KeepsTheObjectsFeaturesFromImageToImage) {
  for (int k = 1; k < kKeyframes; ++k) {
    ASSERT_GT(room_features(k), 40);
    Frame of_object = frame(k);
    ASSERT_TRUE(follower_.follow(TrackerOptions(), &of_object));
    EXPECT_TRUE(of_object.is_masked);
    const auto [of_head, of_room] = kept(of_object, k);
    EXPECT_GT(of_head, 0.9 * head_features(k)) << k;
    EXPECT_LT(of_room, 0.1 * room_features(k)) << k;
  }
}

TEST_F(ObjectFollowerTest, WhatIsOutOfViewIsNotFollowed) {
  Map elsewhere = TwoObjects().map_with(false, 5, 200);
  Frame frame;
  frame.image = elsewhere.keyframe(1)->image;
  const ImageFeaturesPtr all = frame.image;
  // The room with other descriptors.
  const cv::Mat other = 255 - frame.image->set.descriptors;
  auto changed = std::make_shared<ImageFeatures>(*frame.image);
  changed->set.descriptors = other;
  frame.image = changed;
  EXPECT_FALSE(follower_.follow(TrackerOptions(), &frame));
  EXPECT_EQ(frame.image, changed);
  EXPECT_FALSE(frame.is_masked);
}

TEST_F(ObjectFollowerTest, TheRegisteredFeaturesAreTheObject) {
  // All but ten features of the head are assigned to the room.
  TurningObject wrong = start();
  std::fill(wrong.sides.begin() + 10, wrong.sides.end(), FeatureMotion::kMovesOtherwise);
  ObjectFollower follower(wrong);
  Frame of_object = frame(1);
  of_object.is_mask_given = true;
  ASSERT_TRUE(follower.follow(TrackerOptions(), &of_object));
  EXPECT_FALSE(of_object.is_mask_given) << "it was cut down to what was found";
  EXPECT_LT(kept(of_object, 1).first, 0.5 * head_features(1));
  std::vector<cv::Point2f> inliers;
  for (int f = 0; f < head_features(1); ++f) {
    const Eigen::Vector2f& pixel = frame(1).image->set.features[f].pixel;
    inliers.emplace_back(pixel.x(), pixel.y());
  }
  const auto [of_head, of_room] = kept(follower.settle(frame(1), inliers), 1);
  EXPECT_EQ(of_head, head_features(1));
  EXPECT_LT(of_room, 0.1 * room_features(1));
}

}  // namespace
}  // namespace mono_pose_tracker
