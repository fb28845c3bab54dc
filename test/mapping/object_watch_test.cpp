#include "mapping/object_watch.h"

#include <gtest/gtest.h>

#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

class ObjectWatchTest : public testing::Test, protected TwoObjects {
 protected:
  // Passes each keyframe with the one before it. Returns the number of keyframes at which it was certain; 0:
  // never.
  int watch(const Map& map) {
    for (int k = 1; k < kKeyframes; ++k) {
      const RegisteredImage before = registered_image(*map.keyframe(k - 1)),
                            newest = registered_image(*map.keyframe(k));
      watch_.note(before, newest, compare_motions(before, newest, MatchOptions(), ransac()));
      if (watch_.found()) return k + 1;
    }
    return 0;
  }

  ObjectWatch watch_;
};

TEST_F(ObjectWatchTest, AHeadThatTurnsBeforeAMapOfTheRoomIsFound) {
  const Map map = map_with(false, 100, 300);
  const int keyframes = watch(map);
  ASSERT_GT(keyframes, 3) << "one pair, or two, may be chance";
  const TurningObject& object = *watch_.found();
  const int newest = keyframes - 1;
  EXPECT_EQ(object.image, map.keyframe(newest)->image);
  int of_head = 0, of_room = 0, otherwise_of_head = 0;
  for (int f = 0; f < object.image->size(); ++f) {
    const bool is_head = f < head_features(newest);
    of_head += object.sides[f] == FeatureMotion::kTurns && is_head;
    of_room += object.sides[f] == FeatureMotion::kTurns && !is_head;
    otherwise_of_head += object.sides[f] == FeatureMotion::kMovesOtherwise && is_head;
  }
  EXPECT_GT(of_head, 25) << "many obey both motions";
  EXPECT_LE(of_room, 3);
  EXPECT_LE(otherwise_of_head, 3);
}

TEST_F(ObjectWatchTest, TheRoomBehindAMapOfTheHeadIsNot) { EXPECT_EQ(watch(map_with(true, 150, 300)), 0); }

TEST_F(ObjectWatchTest, OneObjectHasNoOther) { EXPECT_EQ(watch(map_with(true, 200, 0)), 0); }

TEST_F(ObjectWatchTest, FewerPointsThanAMapBeginsWithAreNoObject) {
  EXPECT_EQ(watch(map_with(false, 20, 300)), 0);
}

TEST_F(ObjectWatchTest, ForgetsWithTheMap) {
  ASSERT_GT(watch(map_with(false, 60, 300)), 0);
  watch_.reset();
  EXPECT_EQ(watch_.found(), nullptr);
}

}  // namespace
}  // namespace mono_pose_tracker
