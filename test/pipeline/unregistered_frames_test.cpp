#include "pipeline/unregistered_frames.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(UnregisteredFrames, AreAllThatAreRegisteredNowhere) {
  EXPECT_EQ(frames_without_pose({1, 3}, 5), (std::set<std::int64_t>{0, 2, 4}));
  EXPECT_TRUE(frames_without_pose({0, 1}, 2).empty());
}

TEST(UnregisteredFrames, AllAreTakenWhereTheyAreFew) {
  EXPECT_EQ(nearest_to_registered({0, 9}, {5}, 2), (std::set<std::int64_t>{0, 9}));
  EXPECT_EQ(nearest_to_registered({0, 9}, {}, 2), (std::set<std::int64_t>{0, 9}));
}

// A map that begins in the middle grows backwards as well, and images before it do not delay a gap in it.
TEST(UnregisteredFrames, ThoseNearestToAPoseOnEitherSideAreTakenFirst) {
  const std::set<std::int64_t> registered = {10, 11, 12, 16, 17};
  EXPECT_EQ(nearest_to_registered(frames_without_pose(registered, 20), registered, 4),
            (std::set<std::int64_t>{9, 13, 15, 18}));
  EXPECT_EQ(nearest_to_registered(frames_without_pose(registered, 20), registered, 6),
            (std::set<std::int64_t>{8, 9, 13, 14, 15, 18}));
}

}  // namespace
}  // namespace mono_pose_tracker
