#include "mono_pose_tracker/map/map.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "mono_pose_tracker/common/random.h"

namespace mono_pose_tracker {
namespace {

ImageFeaturesPtr image_of(int features) {
  auto image = std::make_shared<ImageFeatures>();
  image->set.features.resize(features);
  return image;
}

Rigid3 pose_at(double x) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0)}; }

TEST(Map, KnowsAnObservationFromBothSides) {
  Map map;
  const KeyframeId k = map.add_keyframe(0, 0, pose_at(0), image_of(3));
  const LandmarkId l = map.add_landmark({0, 0, 1});
  EXPECT_TRUE(map.add_observation(l, k, 1));
  EXPECT_FALSE(map.add_observation(l, k, 2)) << "seen by this keyframe already";
  EXPECT_FALSE(map.add_observation(map.add_landmark({0, 0, 2}), k, 1)) << "the feature is taken";
  EXPECT_EQ(map.keyframe(k)->landmark_of_feature[1], l);
  EXPECT_EQ(map.landmark(l)->observations.size(), 1u);
  map.remove_observation(l, k);
  EXPECT_EQ(map.keyframe(k)->landmark_of_feature[1], kNoLandmark);
  map.check();
}

TEST(Map, CountsSharedLandmarks) {
  Map map;
  for (int i = 0; i < 3; ++i) map.add_keyframe(i, i, pose_at(i), image_of(10));
  for (int f = 0; f < 5; ++f) {
    const LandmarkId l = map.add_landmark({0, 0, 1});
    map.add_observation(l, 0, f);
    map.add_observation(l, 1, f);
    if (f < 2) map.add_observation(l, 2, f);
  }
  const auto covisible = map.covisible(0);
  ASSERT_EQ(covisible.size(), 2u);
  EXPECT_EQ(covisible[0], std::make_pair(1, 5));
  EXPECT_EQ(covisible[1], std::make_pair(2, 2));
}

TEST(Map, MergingKeepsEveryObservationThatDoesNotConflict) {
  Map map;
  for (int i = 0; i < 3; ++i) map.add_keyframe(i, i, pose_at(i), image_of(4));
  const LandmarkId a = map.add_landmark({0, 0, 1}), b = map.add_landmark({0, 0, 1});
  map.add_observation(a, 0, 0);
  map.add_observation(a, 1, 0);
  map.add_observation(b, 1, 1);
  map.add_observation(b, 2, 1);
  map.merge_landmarks(a, b);
  EXPECT_EQ(map.landmark(a), nullptr);
  ASSERT_EQ(map.landmark(b)->observations.size(), 3u);
  EXPECT_EQ(map.landmark(b)->observations[1].feature, 1) << "keyframe 1 keeps what it saw of b";
  EXPECT_EQ(map.keyframe(1)->landmark_of_feature[0], kNoLandmark);
  map.check();
}

TEST(Map, ARemovedKeyframeMovesWithItsParent) {
  Map map;
  for (int i = 0; i < 4; ++i) map.add_keyframe(i, i, pose_at(i), image_of(1));
  map.remove_keyframe(1, 2);
  map.remove_keyframe(2, 3);
  Rigid3 pose;
  ASSERT_TRUE(map.camera_from_map(1, &pose));
  EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(1, 0, 0)).norm(), 0, 1e-12);
  map.keyframe(3)->camera_from_map = pose_at(13);
  ASSERT_TRUE(map.camera_from_map(1, &pose));
  EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(11, 0, 0)).norm(), 0, 1e-12);
  EXPECT_FALSE(map.camera_from_map(99, &pose));
  map.check();
}

// The invariants hold whatever is done to a map, in whatever order.
TEST(Map, InvariantsHoldUnderRandomOperations) {
  Random random(1);
  Map map;
  for (int i = 0; i < 8; ++i) map.add_keyframe(i, i, pose_at(i), image_of(20));
  for (int step = 0; step < 5000; ++step) {
    const LandmarkId l = static_cast<LandmarkId>(random.index(60)),
                     other = static_cast<LandmarkId>(random.index(60));
    const KeyframeId k = static_cast<KeyframeId>(random.index(8));
    switch (random.index(12)) {
      case 0:
        map.add_landmark({0, 0, 1});
        break;
      case 1:
        map.remove_landmark(l);
        break;
      case 2:
        map.merge_landmarks(l, other);
        break;
      case 3:
        map.remove_observation(l, k);
        break;
      case 4:
        if (step % 500 == 0) map.remove_keyframe(k, static_cast<KeyframeId>(random.index(8)));
        break;
      default:
        map.add_observation(l, k, static_cast<int>(random.index(20)));
    }
    if (step % 50 == 0) {
      ASSERT_NO_THROW(map.check()) << "step " << step;
    }
  }
}

}  // namespace
}  // namespace mono_pose_tracker
