#include "pipeline/doubtful_frames.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace mono_pose_tracker {
namespace {

std::vector<RegisteredFrame> registered(const std::vector<std::int64_t>& frames) {
  std::vector<RegisteredFrame> trajectory;
  for (const std::int64_t frame : frames) {
    trajectory.emplace_back();
    trajectory.back().index = frame;
  }
  return trajectory;
}

TEST(DoubtfulFrames, BetweenTwoThatAreBeyondDoubtOneIsNone) {
  EXPECT_TRUE(doubtful_alone(registered({0, 1, 2}), {1}).empty());
  EXPECT_EQ(doubtful_alone(registered({0, 1, 2}), {2}), std::vector<std::int64_t>{2});
  EXPECT_EQ(doubtful_alone(registered({0, 1, 2, 3}), {1, 2}), (std::vector<std::int64_t>{1, 2}));
  EXPECT_TRUE(doubtful_alone(registered({0, 2}), {1}).empty()) << "it has no pose";
}

// As a single image of a wall whose pattern repeats, after images that were not registered.
TEST(DoubtfulFrames, FramesThatNoThirdViewConfirmsAreIsolated) {
  EXPECT_EQ(isolated_frames(registered({0, 1, 2, 3, 9, 15, 16, 25, 27, 29})),
            (std::set<std::int64_t>{9, 15, 16}));
  EXPECT_EQ(isolated_frames(registered({0, 1, 9, 10, 11})), (std::set<std::int64_t>{0, 1}));
  EXPECT_TRUE(isolated_frames(registered({3, 5, 7, 9})).empty()) << "every second image is blurred";
}

// One of six may distort half of the path; a few of a hundred hardly matter.
TEST(DoubtfulFrames, OnADoubtfulFrameAShortPathMayBeDistorted) {
  EXPECT_FALSE(may_distort_path(0, 6));
  EXPECT_TRUE(may_distort_path(1, 40));
  EXPECT_FALSE(may_distort_path(1, 50));
  EXPECT_FALSE(may_distort_path(11, 100));
  EXPECT_TRUE(may_distort_path(12, 100));
  EXPECT_FALSE(may_distort_path(100, 1000));
  EXPECT_TRUE(may_distort_path(300, 1000)) << "each leads to the next";
}

}  // namespace
}  // namespace mono_pose_tracker
