#include <gtest/gtest.h>

#include "simulation/walk_studies.h"

namespace mono_pose_tracker {
namespace {

constexpr double kNoise = 0.5;  // px

LoopStudy study(const FeatureWalk& walk, bool close_loops = true, bool find_limit = false) {
  return run_loop_study(walk, walk_camera(), TrackerOptions(), kNoise, 1, close_loops, find_limit);
}

TEST(LoopStudy, ALoopIsClosedOnARing) {
  const LoopStudy with = study(ring_walk(1), true, true), without = study(ring_walk(1), false);
  EXPECT_EQ(with.frames_posed, with.frames);
  ASSERT_FALSE(with.loops.empty());
  for (const StudiedLoop& loop : with.loops) EXPECT_LT(loop.apart, 3) << loop.from_frame << loop.to_frame;
  EXPECT_TRUE(without.loops.empty());
  EXPECT_LT(with.position_rmse, 0.005);
  EXPECT_LT(with.position_rmse, 0.5 * without.position_rmse);
  // What noise leaves open, and no more.
  EXPECT_GT(with.limit_rmse, 0);
  EXPECT_LT(with.position_rmse, 2 * with.limit_rmse);
  // The camera goes on as before: a correction is no movement.
  EXPECT_LT(with.worst_prediction, 2 * without.worst_prediction);
}

// Past each corner of a house all that is new is four times as far as the house.
TEST(LoopStudy, ABlockIsWalkedRound) {
  const LoopStudy result = study(block_walk(1));
  EXPECT_EQ(result.frames_posed, result.frames);
  ASSERT_FALSE(result.loops.empty());
  for (const StudiedLoop& loop : result.loops) EXPECT_LT(loop.apart, 10) << loop.from_frame << loop.to_frame;
  EXPECT_LT(result.position_rmse, 0.01);
}

TEST(LoopStudy, TwoRoomsWithTheSameFurnitureAreNoLoop) {
  const LoopStudy result = study(repetitive_corridor_walk(1));
  EXPECT_EQ(result.frames_posed, result.frames);
  EXPECT_TRUE(result.loops.empty());
  EXPECT_LT(result.position_rmse, 0.02);
}

TEST(LoopStudy, TheSameFiguresEveryTime) {
  const LoopStudy a = study(ring_walk(2)), b = study(ring_walk(2));
  EXPECT_EQ(a.position_rmse, b.position_rmse);
  EXPECT_EQ(a.loops.size(), b.loops.size());
}

// Times are for the benchmark: here only what they are of.
TEST(GrowthStudy, MapsOfTheSizesThatWereAskedForAreMeasured) {
  const std::vector<GrowthStep> steps =
      run_growth_study(street_walk(1, 60), walk_camera(), TrackerOptions(), {12, 24}, 12);
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(steps[0].keyframes, 12);
  EXPECT_EQ(steps[1].keyframes, 24) << "each frame is a keyframe that stays";
  EXPECT_GT(steps[1].landmarks, steps[0].landmarks);
  for (const GrowthStep& step : steps) EXPECT_GT(step.keyframe_ms, 0);
  EXPECT_GT(steps[0].finish_s, 0);
  EXPECT_GT(steps[0].global_adjust_s, 0);
  EXPECT_EQ(steps[1].finish_s, 0) << "larger than was asked for";
}

TEST(GrowthStudy, BeforeOneWallEverythingIsCovisible) {
  const std::vector<GrowthStep> street =
      run_growth_study(street_walk(1, 60), walk_camera(), TrackerOptions(), {50}, 0);
  const std::vector<GrowthStep> wall =
      run_growth_study(wall_walk(1, 60), walk_camera(), TrackerOptions(), {50}, 0);
  ASSERT_EQ(street.size(), 1u);
  ASSERT_EQ(wall.size(), 1u);
  EXPECT_LT(wall[0].landmarks, 0.7 * street[0].landmarks);
}

}  // namespace

}  // namespace mono_pose_tracker
