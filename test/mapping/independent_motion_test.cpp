#include "mapping/independent_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/synthetic_views.h"
#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

class IndependentMotionTest : public testing::Test, protected TwoObjects {
 protected:
  IndependentMotion find(const Map& map) const {
    return find_independent_motion(map, {}, ComparedImages::kKeyframes, MatchOptions(), ransac(), 1);
  }
};

TEST_F(IndependentMotionTest, AHeadBeforeAMapOfTheRoomTurnsMore) {
  const IndependentMotion motion = find(map_with(false, 60, 300));
  ASSERT_TRUE(motion.exists());
  EXPECT_FALSE(motion.rotates_plainly_less());
  EXPECT_GT(motion.other_rotation, 3 * motion.map_rotation);
  EXPECT_FALSE(motion.is_comparable()) << "one point in six";
}

TEST_F(IndependentMotionTest, TheRoomBehindAMapOfTheHeadTurnsLess) {
  const IndependentMotion motion = find(map_with(true, 150, 200));
  ASSERT_TRUE(motion.exists());
  EXPECT_TRUE(motion.rotates_plainly_less());
  EXPECT_TRUE(motion.is_comparable());
}

// The head turns away and its features become the minority: half of the rotation is the map's.
TEST_F(IndependentMotionTest, OfAMapOfTheHeadHereAndOfTheRoomThereTheOtherTurnsAlone) {
  Map map = map_with(true, 150, 200);
  EXPECT_EQ(find(map).other_rotation_alone, 0);
  const Map of_room = map_with(false, 150, 200);
  const KeyframeId last_of_head = kKeyframes / 2;
  for (KeyframeId k = last_of_head + 1; k < kKeyframes; ++k) {
    map.set_pose(k, of_room.keyframe(k)->camera_from_map *
                        of_room.keyframe(last_of_head)->camera_from_map.inverse() *
                        map.keyframe(last_of_head)->camera_from_map);
  }
  const IndependentMotion motion = find(map);
  EXPECT_GT(motion.other_rotation_alone, IndependentMotion::kRotatesAlone);
  EXPECT_FALSE(motion.rotates_plainly_less());
}

TEST_F(IndependentMotionTest, OneObjectHasNoOther) { EXPECT_FALSE(find(map_with(true, 200, 0)).exists()); }

TEST_F(IndependentMotionTest, ItMayExistWhereMorePairsShowItThanChanceMakes) {
  IndependentMotion motion;
  motion.pairs = 4, motion.other_pairs = 1;
  EXPECT_TRUE(motion.exists());
  motion.pairs = 30, motion.other_pairs = 2;
  EXPECT_FALSE(motion.may_exist());
  motion.other_pairs = 3;
  EXPECT_TRUE(motion.may_exist());
  EXPECT_FALSE(motion.exists());
  motion.pairs = 100, motion.other_pairs = 9;
  EXPECT_FALSE(motion.may_exist());
}

// A screen full of letters before a room of few features.
TEST(IndependentMotion, WhatFillsTheViewIsComparable) {
  IndependentMotion motion;
  motion.pairs = motion.other_pairs = 10;
  motion.cell_px = 80;
  for (int i = 0; i < 200; ++i) motion.tracks.push_back({0, 10, {300.f + i % 40, 300.f}, {310, 300}, false});
  for (int i = 0; i < 20; ++i) motion.tracks.push_back({0, 10, {i % 8 * 80.f, i / 8 * 80.f}, {0, 0}, true});
  EXPECT_LT(motion.share(), IndependentMotion::kComparable);
  EXPECT_GT(motion.share_of_view(), 0.9);
  EXPECT_TRUE(motion.is_comparable());
  for (MotionTrack& track : motion.tracks) track.is_other = !track.is_other;
  EXPECT_LT(motion.share_of_view(), 0.1);
  EXPECT_EQ(IndependentMotion().share_of_view(), 0);
}

TEST_F(IndependentMotionTest, AMapExplainsWhatItIsOf) {
  EXPECT_GT(find(map_with(true, 200, 0)).explained(), 0.95);
  EXPECT_NEAR(find(map_with(true, 150, 200)).explained(), 150.0 / 350, 0.2);
  EXPECT_EQ(IndependentMotion().explained(), 0);
}

TEST_F(IndependentMotionTest, ASampleTellsItAsWell) {
  Map map = map_with(true, 150, 200);
  const IndependentMotion sample = sample_independent_motion(map, MatchOptions(), ransac(), false, false, 1);
  EXPECT_EQ(sample.pairs, kKeyframes - 1);
  EXPECT_TRUE(sample.is_comparable());
  EXPECT_FALSE(sample_independent_motion(map_with(true, 200, 0), MatchOptions(), ransac(), false, false, 1)
                   .is_comparable());
  EXPECT_FALSE(sample_independent_motion(Map(), MatchOptions(), ransac(), false, false, 1).exists());
}

// A camera that moves sideways in front of a railing and a skyline. far_side: 1, or -1 where the map has the
// opposite motion for far points, by more than noise.
class Skyline : public testing::Test {
 protected:
  Map map_with(double nearest, double far_side) {
    std::vector<Eigen::Vector3d> x;
    for (int i = 0; i < 300; ++i) {
      const double depth = i < 60 ? random_.uniform(3, 5) : random_.uniform(nearest, 2 * nearest);
      x.emplace_back(depth * random_.uniform(-0.5, 0.5), depth * random_.uniform(-0.35, 0.35), depth);
    }
    const SyntheticScene scene(x, random_);
    Map map;
    for (int k = 0; k < 10; ++k) {
      const Frame frame = synthetic_frame(scene, camera_, camera_at({0.05 * k, 0, 0}), 0.4, k, random_);
      map.add_keyframe(k, k, camera_at({0.05 * far_side * k, 0, 0}), frame.image);
    }
    return map;
  }

  IndependentMotion sample(const Map& map, bool is_connected) const {
    return sample_independent_motion(map, MatchOptions(), ransac_of_two_px(camera_), false, is_connected, 1);
  }

 private:
  Random random_{5};
  CameraModel camera_ = synthetic_camera();
};

TEST_F(Skyline, IsNoObjectForItsNoise) {
  const Map map = map_with(2000, 1);
  EXPECT_TRUE(sample(map, false).is_comparable());
  EXPECT_FALSE(sample(map, true).exists());
  EXPECT_EQ(sample(map, true).explained(), sample(map, false).explained()) << "one measure for all maps";
}

TEST_F(Skyline, BehindTheCamerasForTheMostPartSpeaksAgainstTheMap) {
  const Map map = map_with(30, -1);
  EXPECT_TRUE(sample(map, false).is_comparable());
  EXPECT_TRUE(sample(map, true).is_comparable());
}

TEST_F(IndependentMotionTest, TracksTellWhichFeaturesAreWhose) {
  const Map map = map_with(false, 100, 300);
  const IndependentMotion motion = find(map);
  int right = 0, wrong = 0, of_head = 0;
  for (const MotionTrack& track : motion.tracks) {
    const auto& features = map.keyframe(static_cast<KeyframeId>(track.from_index))->image->set.features;
    int f = 0;
    while (features[f].pixel != track.from) ++f;
    const bool is_head = f < head_features(static_cast<int>(track.from_index));
    of_head += is_head;
    (is_head == track.is_other ? right : wrong) += 1;
  }
  EXPECT_GT(of_head, 400);
  EXPECT_LT(wrong, 0.05 * right);
}

TEST_F(IndependentMotionTest, ImagesBetweenTheKeyframesAreInTheTracks) {
  const Map map = map_with(false, 100, 300);
  Map sparse;
  std::vector<RegisteredImage> between;
  for (const auto& [id, k] : map.keyframes()) {
    if (id % 2 == 0) sparse.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map, k.image);
    if (id % 2 != 0) between.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  const IndependentMotion motion =
      find_independent_motion(sparse, between, ComparedImages::kAllSeen, MatchOptions(), ransac(), 1);
  ASSERT_FALSE(motion.tracks.empty());
  for (const MotionTrack& track : motion.tracks) EXPECT_EQ(track.to_index, track.from_index + 1);
}

// A camera that hardly moves makes no keyframes while the head in front of it rotates.
TEST_F(IndependentMotionTest, WhereThereAreNoKeyframesTheImagesBetweenAreCompared) {
  const Map map = map_with(false, 100, 300);
  Map sparse;
  std::vector<RegisteredImage> seen;
  for (const auto& [id, k] : map.keyframes()) {
    if (id < 3) sparse.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map, k.image);
    seen.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  EXPECT_EQ(find(sparse).pairs, 2 + 1);
  const IndependentMotion motion =
      find_independent_motion(sparse, seen, ComparedImages::kAllSeen, MatchOptions(), ransac(), 1);
  EXPECT_EQ(motion.pairs, find(map).pairs);
  EXPECT_EQ(motion.other_pairs, find(map).other_pairs);
}

// The keyframes of a room's map keep features near its points: the head is excluded.
TEST_F(IndependentMotionTest, FeaturesTheMapExcludedAreSeen) {
  const Map map = map_with(false, 100, 300);
  Map without_head;
  std::vector<RegisteredImage> seen;
  for (const auto& [id, k] : map.keyframes()) {
    std::vector<char> is_room(k.image->size(), 1);
    std::fill_n(is_room.begin(), head_features(static_cast<int>(id)), 0);
    without_head.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map,
                              select_features(*k.image, is_room, camera().width(), camera().height()));
    seen.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  EXPECT_FALSE(find(without_head).exists());
  EXPECT_TRUE(
      find_independent_motion(without_head, seen, ComparedImages::kKeyframes, MatchOptions(), ransac(), 1)
          .exists());
}

TEST_F(IndependentMotionTest, TheTurnIsWhatTheCamerasSpan) {
  EXPECT_NEAR(rotation_before_cameras(map_with(true, 200, 0)) / kDegree, 6.0 * (kKeyframes - 1), 3);
  EXPECT_LT(rotation_before_cameras(map_with(false, 50, 200)) / kDegree, 5);
}

}  // namespace
}  // namespace mono_pose_tracker
