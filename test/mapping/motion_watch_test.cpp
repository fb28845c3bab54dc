#include "mapping/map_motions.h"

#include <gtest/gtest.h>

#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

class MotionWatchTest : public testing::Test, protected TwoObjects {
 protected:
  // Passes each keyframe with the one before it. Returns the number of keyframes at which it was certain; 0:
  // never.
  int watch(const Map& map, bool object_turns = true) {
    MotionSegmentationOptions options;
    options.ransac = ransac();
    for (int k = 1; k < kKeyframes; ++k) {
      const RegisteredImage before = registered_image(*map.keyframe(k - 1)),
                            newest = registered_image(*map.keyframe(k));
      watch_.add_pair(before, newest, compare_motions(before, newest, options), object_turns);
      if (!watch_.doubt().empty()) return k + 1;
    }
    return 0;
  }

  MotionWatch watch_;
};

TEST_F(MotionWatchTest, AHeadThatTurnsBeforeAMapOfTheRoomIsFound) {
  const Map map = map_with(false, 100, 300);
  const int keyframes = watch(map);
  ASSERT_GT(keyframes, 3) << "one pair, or two, may be chance";
  const TurningObject& object = *watch_.object();
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

TEST_F(MotionWatchTest, TheRoomBehindAMapOfTheHeadIsNot) { EXPECT_EQ(watch(map_with(true, 150, 300)), 0); }

TEST_F(MotionWatchTest, OneObjectHasNoOther) { EXPECT_EQ(watch(map_with(true, 200, 0)), 0); }

TEST_F(MotionWatchTest, FewerPointsThanAMapBeginsWithAreNoObject) {
  EXPECT_EQ(watch(map_with(false, 20, 300)), 0);
}

TEST_F(MotionWatchTest, WhoWantsTheLargestHearsOfALargeObject) {
  EXPECT_GT(watch(map_with(false, 250, 60), false), 3);
  EXPECT_NE(watch_.doubt().find("of the points move as one"), std::string::npos) << watch_.doubt();
  EXPECT_FALSE(watch_.object());
}

TEST_F(MotionWatchTest, ASmallObjectIsNoDoubt) {
  EXPECT_EQ(watch(map_with(false, 60, 300), false), 0) << watch_.doubt();
}

}  // namespace
}  // namespace mono_pose_tracker
