#include "tracking/posed_sight.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// Taken at one pose, posed at another: what it shows there are the same points, as far aside as the poses
// are.
PosedSight sight(const SyntheticScene& scene, const Rigid3& taken_at, const Rigid3& posed_at,
                 Random& random) {
  std::vector<int> point_of;
  PosedSight result;
  result.camera_from_map = posed_at;
  result.image = synthetic_frame(scene, synthetic_camera(), taken_at, 0.5, 0, random, &point_of).image;
  const Rigid3 posed_from_taken = posed_at.inverse() * taken_at;
  for (std::size_t f = 0; f < point_of.size(); ++f) {
    result.features.push_back(static_cast<int>(f));
    result.points.push_back(posed_from_taken * scene.x_in_map[point_of[f]]);
  }
  return result;
}

TEST(PosedSight, TwoImagesShowTheWayBetweenTheirPoses) {
  Random random(1);
  const SyntheticScene scene = box_scene(300, random);
  const Rigid3 here = camera_at({0, 0, 0}), there = camera_at({0.4, 0, 0}, 0.05);
  const PosedSight a = sight(scene, here, here, random), b = sight(scene, there, there, random);
  EXPECT_EQ(way_shown(a, b, MatchOptions()), WayShown::kShown);
  EXPECT_EQ(way_shown(b, a, MatchOptions()), WayShown::kShown);
  EXPECT_EQ(way_shown(a, a, MatchOptions()), WayShown::kAgree) << "no step";
}

// Each of the two agrees with the map where it is posed; that they see the same gives it away.
TEST(PosedSight, AnImagePosedAtAPlaceThatLooksAlikeDoesNot) {
  Random random(2);
  const SyntheticScene scene = box_scene(300, random);
  const Rigid3 here = camera_at({0, 0, 0}), next_door = camera_at({1.5, 0, 0});
  const PosedSight a = sight(scene, here, here, random), b = sight(scene, here, next_door, random);
  EXPECT_EQ(way_shown(a, b, MatchOptions()), WayShown::kNot);
}

TEST(PosedSight, AFewPointsShowNothing) {
  Random random(3);
  const SyntheticScene scene = box_scene(25, random);
  const Rigid3 here = camera_at({0, 0, 0});
  const PosedSight a = sight(scene, here, here, random);
  EXPECT_EQ(way_shown(a, a, MatchOptions()), WayShown::kNot);
}

}  // namespace
}  // namespace mono_pose_tracker
