#include "mono_pose_tracker/mapping/other_body.h"

#include <gtest/gtest.h>

#include "support/two_bodies.h"

namespace mono_pose_tracker {
namespace {

class OtherBodyTest : public testing::Test, protected TwoBodies {
 protected:
  OtherBody find(const Map& map) const { return find_other_body(map, {}, MatchOptions(), ransac(), 1); }
};

TEST_F(OtherBodyTest, AHeadBeforeAMapOfTheRoomTurnsMore) {
  const OtherBody body = find(map_with(false, 60, 300));
  ASSERT_TRUE(body.exists());
  EXPECT_FALSE(body.turns_plainly_less());
  EXPECT_GT(body.other_turn, 3 * body.map_turn);
  EXPECT_FALSE(body.is_comparable()) << "one point in six";
}

TEST_F(OtherBodyTest, TheRoomBehindAMapOfTheHeadTurnsLess) {
  const OtherBody body = find(map_with(true, 150, 200));
  ASSERT_TRUE(body.exists());
  EXPECT_TRUE(body.turns_plainly_less());
  EXPECT_TRUE(body.is_comparable());
}

TEST_F(OtherBodyTest, OneBodyHasNoOther) { EXPECT_FALSE(find(map_with(true, 200, 0)).exists()); }

TEST_F(OtherBodyTest, AMapExplainsWhatItIsOf) {
  EXPECT_GT(find(map_with(true, 200, 0)).explained(), 0.95);
  EXPECT_NEAR(find(map_with(true, 150, 200)).explained(), 150.0 / 350, 0.2);
  EXPECT_EQ(OtherBody().explained(), 0);
}

TEST_F(OtherBodyTest, ASampleTellsItAsWell) {
  Map map = map_with(true, 150, 200);
  const OtherBody sample = sample_other_body(map, MatchOptions(), ransac(), 1);
  EXPECT_EQ(sample.pairs, kKeyframes - 1);
  EXPECT_TRUE(sample.is_comparable());
  EXPECT_FALSE(sample_other_body(map_with(true, 200, 0), MatchOptions(), ransac(), 1).is_comparable());
  EXPECT_FALSE(sample_other_body(Map(), MatchOptions(), ransac(), 1).exists());
}

TEST_F(OtherBodyTest, TracksTellWhichFeaturesAreWhose) {
  const Map map = map_with(false, 100, 300);
  const OtherBody body = find(map);
  int right = 0, wrong = 0, of_head = 0;
  for (const BodyTrack& track : body.tracks) {
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

TEST_F(OtherBodyTest, ImagesBetweenTheKeyframesAreInTheTracks) {
  const Map map = map_with(false, 100, 300);
  Map sparse;
  std::vector<PosedImage> between;
  for (const auto& [id, k] : map.keyframes()) {
    if (id % 2 == 0) sparse.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map, k.image);
    if (id % 2 != 0) between.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  const OtherBody body = find_other_body(sparse, between, MatchOptions(), ransac(), 1);
  ASSERT_FALSE(body.tracks.empty());
  for (const BodyTrack& track : body.tracks) EXPECT_EQ(track.to_index, track.from_index + 1);
}

TEST_F(OtherBodyTest, TheTurnIsWhatTheCamerasSpan) {
  EXPECT_NEAR(turn_before_cameras(map_with(true, 200, 0)) / kDegree, 6.0 * (kKeyframes - 1), 3);
  EXPECT_LT(turn_before_cameras(map_with(false, 50, 200)) / kDegree, 5);
}

}  // namespace
}  // namespace mono_pose_tracker
