#include "mapping/larger_object_watch.h"

#include <gtest/gtest.h>

#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

class LargerObjectWatchTest : public testing::Test, protected TwoObjects {
 protected:
  // Passes the map's keyframes one after the other.
  void show(const Map& whole, double seconds_apart = 1.5) {
    Map map;
    for (const auto& [id, keyframe] : whole.keyframes()) {
      const auto stamp_ns = static_cast<std::int64_t>(1e9 * seconds_apart * id);
      map.add_keyframe(id, stamp_ns, keyframe.camera_from_map, keyframe.image);
      watch_.ask(map, MatchOptions(), ransac());
    }
  }

  LargerObjectWatch watch_;
};

TEST_F(LargerObjectWatchTest, AHeadBeforeAMapOfFewPointsOfTheRoomIsTold) {
  show(map_with(false, 250, 60));
  EXPECT_NE(watch_.doubt().find("of the points move as one"), std::string::npos) << watch_.doubt();
  watch_.reset();
  EXPECT_TRUE(watch_.doubt().empty());
}

TEST_F(LargerObjectWatchTest, TheSmallerObjectIsNoDoubt) {
  show(map_with(false, 100, 250));
  EXPECT_TRUE(watch_.doubt().empty()) << watch_.doubt();
}

TEST_F(LargerObjectWatchTest, OneObjectIsNoDoubt) {
  show(map_with(true, 250, 0));
  EXPECT_TRUE(watch_.doubt().empty()) << watch_.doubt();
}

TEST_F(LargerObjectWatchTest, ItAsksNowAndThen) {
  show(map_with(false, 250, 60), 0.1);  // two of eight keyframes are checked
  EXPECT_TRUE(watch_.doubt().empty()) << watch_.doubt();
}

}  // namespace
}  // namespace mono_pose_tracker
