#include "mono_pose_tracker/mapping/seam.h"

#include <gtest/gtest.h>

#include <limits>

namespace mono_pose_tracker {
namespace {

// Keyframes of every tenth frame, and landmarks that the keyframes from first to last see.
class SeamTest : public testing::Test {
 protected:
  SeamTest() {
    auto image = std::make_shared<ImageFeatures>();
    image->set.features.resize(1000);
    for (int i = 0; i < 10; ++i) map_.add_keyframe(10 * i, i, Rigid3(), image);
  }

  void add_landmarks(int count, KeyframeId first, KeyframeId last) {
    for (int i = 0; i < count; ++i, ++feature_) {
      const LandmarkId l = map_.add_landmark({0, 0, 1});
      for (KeyframeId k = first; k <= last; ++k) map_.add_observation(l, k, feature_);
    }
  }

  Map map_;
  int feature_ = 0;
};

TEST_F(SeamTest, IsWhereFewLandmarksAreKnownFromBothSides) {
  add_landmarks(100, 0, 5);
  add_landmarks(100, 4, 9);
  // The first hundred hold the seams before keyframes 2, 3, 4; the second those before 6, 7, 8.
  add_landmarks(7, 2, 7);  // those from before 4 to before 6
  const Seam seam = weakest_seam(map_);
  EXPECT_EQ(seam.frame_index, 50);
  EXPECT_EQ(seam.points, 7);
}

TEST_F(SeamTest, PointsThatOneKeyframeOfASideSeesHoldNothing) {
  add_landmarks(50, 0, 5);
  add_landmarks(50, 4, 9);
  add_landmarks(30, 4, 5);
  EXPECT_EQ(weakest_seam(map_).points, 0);
  EXPECT_EQ(weakest_seam(map_).frame_index, 50);
}

TEST_F(SeamTest, ALoopHoldsTheSeamsThatItSpans) {
  add_landmarks(20, 0, 1);
  for (int i = 0; i < 20; ++i, ++feature_) {
    const LandmarkId l = map_.add_landmark({0, 0, 1});
    for (const KeyframeId k : {0, 1, 8, 9}) map_.add_observation(l, k, feature_);
  }
  EXPECT_EQ(weakest_seam(map_).points, 20);
}

TEST_F(SeamTest, AMapOfThreeKeyframesHasNone) {
  for (KeyframeId k = 3; k < 10; ++k) map_.remove_keyframe(k, 0);
  EXPECT_EQ(weakest_seam(map_).points, std::numeric_limits<int>::max());
}

TEST_F(SeamTest, ALooseEndIsWhatTooFewPointsHold) {
  add_landmarks(100, 0, 7);
  add_landmarks(100, 6, 9);
  add_landmarks(10, 5, 8);
  EXPECT_EQ(loose_end(map_, 3), std::set<KeyframeId>({7, 8, 9}));
  EXPECT_TRUE(loose_end(map_, 2).empty()) << "more than are too little for a map";
  EXPECT_TRUE(loose_end(map_, 7).empty()) << "the others would be too little as well";
  add_landmarks(30, 5, 8);
  EXPECT_TRUE(loose_end(map_, 3).empty()) << "held by forty";
}

TEST_F(SeamTest, WhatHoldsTheFrameIsNoLooseEnd) {
  add_landmarks(100, 0, 2);
  add_landmarks(100, 3, 9);
  EXPECT_TRUE(loose_end(map_, 5).empty());
}

// The second in time is the first of the map, and sees what those after it see.
TEST_F(SeamTest, OneByWhichTheMapHasItsFrameMayBeLeft) {
  auto image = std::make_shared<ImageFeatures>();
  image->set.features.resize(1000);
  Map map;
  for (const std::int64_t frame : {10, 60, 20, 30, 40, 50, 70, 80, 0}) {
    map.add_keyframe(frame, 0, Rigid3(), image);
  }
  for (int i = 0; i < 100; ++i) {
    const LandmarkId l = map.add_landmark({0, 0, 1});
    for (KeyframeId k = 0; k < 8; ++k) map.add_observation(l, k, i);
  }
  ASSERT_EQ(weakest_seam(map).frame_index, 20);
  EXPECT_EQ(loose_end(map, 4), std::set<KeyframeId>{8});
}

TEST_F(SeamTest, EarlierRunsAreNoLooseEnd) {
  auto image = std::make_shared<ImageFeatures>();
  image->set.features.resize(1000);
  Map map;
  // The first two are of this run; those of the one before come before them in time.
  for (const std::int64_t frame : {0, 10, 20, 30, 40, -40, -30, -20, -10}) {
    map.add_keyframe(frame, 0, Rigid3(), image);
  }
  const std::vector<std::set<KeyframeId>> seen = {
      {5, 6, 7, 8}, {6, 7, 8, 0}, {8, 0, 1, 2}, {0, 1, 2, 3}, {1, 2, 3, 4}};
  for (int f = 0; f < 500; ++f) {
    const LandmarkId l = map.add_landmark({0, 0, 1});
    for (const KeyframeId k : seen[f % 5]) map.add_observation(l, k, f);
  }
  ASSERT_EQ(weakest_seam(map).frame_index, 0);
  ASSERT_FALSE(weakest_seam(map).holds());
  EXPECT_TRUE(loose_end(map, 4).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
