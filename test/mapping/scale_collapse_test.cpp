#include "mono_pose_tracker/mapping/scale_collapse.h"

#include <gtest/gtest.h>

#include "support/add_view.h"

namespace mono_pose_tracker {
namespace {

constexpr int kInARow = 7, kShown = 200, kNearPoints = 30;

// Keyframes before a box of points, some of which lie `size` times as far from the last of them as they
// should.
Map map_with_near(double size) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kShown, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kInARow; ++k) {
    add_view(scene, camera, camera_at({0.03 * k, 0, 0}, 0), 0.5, k, ids, random, &map);
  }
  const Eigen::Vector3d last = map.keyframes().rbegin()->second.center_in_map();
  for (int i = 0; i < kNearPoints; ++i) {
    map.set_position(ids[i], last + size * (scene.x_in_map[i] - last));
  }
  return map;
}

TEST(ScaleCollapse, ThereIsNoneInARightMap) {
  const ScaleCollapse none = worst_scale_collapse(map_with_near(1));
  EXPECT_FALSE(none.is_significant());
  EXPECT_EQ(none.near, 0);
}

TEST(ScaleCollapse, AHandBeforeTheSkylineIsNone) {
  EXPECT_FALSE(worst_scale_collapse(map_with_near(1e-3)).is_significant());
}

TEST(ScaleCollapse, IsToldWithItsKeyframe) {
  const ScaleCollapse worst = worst_scale_collapse(map_with_near(1e-7));
  EXPECT_TRUE(worst.is_significant());
  EXPECT_GE(worst.near, kNearPoints / 2);
  EXPECT_LE(worst.near, kNearPoints);
  EXPECT_EQ(worst.frame_index, kInARow - 1);
  EXPECT_LT(worst.near, 0.5 * worst.landmarks);
}

TEST(ScaleCollapse, AnEmptyMapHasNone) { EXPECT_FALSE(worst_scale_collapse(Map()).is_significant()); }

}  // namespace
}  // namespace mono_pose_tracker
