#include "simulation/walk_studies.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

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
