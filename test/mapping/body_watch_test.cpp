#include "mapping/body_watch.h"

#include <gtest/gtest.h>

#include "support/two_bodies.h"

namespace mono_pose_tracker {
namespace {

class BodyWatchTest : public testing::Test, protected TwoBodies {
 protected:
  // Each keyframe with the one before it, as they come; how many had come when it was certain, 0: never.
  int watch(const Map& map) {
    for (int k = 1; k < kKeyframes; ++k) {
      const PosedImage before = posed_image(*map.keyframe(k - 1)), newest = posed_image(*map.keyframe(k));
      watch_.note(before, newest, compare_motions(before, newest, MatchOptions(), ransac()));
      if (watch_.found()) return k + 1;
    }
    return 0;
  }

  BodyWatch watch_;
};

TEST_F(BodyWatchTest, AHeadThatTurnsBeforeAMapOfTheRoomIsFound) {
  const Map map = map_with(false, 100, 300);
  const int keyframes = watch(map);
  ASSERT_GT(keyframes, 3) << "one pair, or two, may be chance";
  const TurningObject& body = *watch_.found();
  const int newest = keyframes - 1;
  EXPECT_EQ(body.image, map.keyframe(newest)->image);
  int of_head = 0, of_room = 0, otherwise_of_head = 0;
  for (int f = 0; f < body.image->size(); ++f) {
    const bool is_head = f < head_features(newest);
    of_head += body.sides[f] == FeatureMotion::kTurns && is_head;
    of_room += body.sides[f] == FeatureMotion::kTurns && !is_head;
    otherwise_of_head += body.sides[f] == FeatureMotion::kMovesOtherwise && is_head;
  }
  EXPECT_GT(of_head, 25) << "many obey both motions";
  EXPECT_LE(of_room, 3);
  EXPECT_LE(otherwise_of_head, 3);
}

TEST_F(BodyWatchTest, TheRoomBehindAMapOfTheHeadIsNot) { EXPECT_EQ(watch(map_with(true, 150, 300)), 0); }

TEST_F(BodyWatchTest, OneBodyHasNoOther) { EXPECT_EQ(watch(map_with(true, 200, 0)), 0); }

TEST_F(BodyWatchTest, FewerPointsThanAMapBeginsWithAreNoBody) {
  EXPECT_EQ(watch(map_with(false, 20, 300)), 0);
}

TEST_F(BodyWatchTest, ForgetsWithTheMap) {
  ASSERT_GT(watch(map_with(false, 60, 300)), 0);
  watch_.reset();
  EXPECT_EQ(watch_.found(), nullptr);
}

}  // namespace
}  // namespace mono_pose_tracker
