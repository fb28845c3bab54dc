#include "mapping/depth_jump.h"

#include <gtest/gtest.h>

#include "known_scene.h"

namespace mono_pose_tracker {
namespace {

class DepthJump : public testing::Test {
 protected:
  static constexpr int kPoints = 400;

  // Three views of a scene: points with even numbers are known to the first two, the others are made with the
  // third, `size` times as far from the first view as they are.
  Map map_made(double size, int made) {
    Map map;
    for (int view = 0; view < 2; ++view) add(view, &map);
    for (int p = 0; p < kPoints; p += 2) add_point(p, 1, {0, 1}, &map);
    add(2, &map);
    for (int p = 1; p < kPoints && made > 0; p += 2) made -= add_point(p, size, {0, 2}, &map);
    return map;
  }

  void add(int view, Map* map) {
    const Frame frame = scene_.frame(view);
    map->add_keyframe(view, frame.stamp_ns, KnownScene::pose(view), frame.image);
  }

  bool add_point(int point, double size, const std::vector<KeyframeId>& views, Map* map) {
    for (const KeyframeId id : views) {
      if (scene_.feature_of(id, point) < 0) return false;
    }
    const Eigen::Vector3d first = map->keyframe(0)->center_in_map();
    const LandmarkId l = map->add_landmark(first + size * (scene_.scene.x_in_map[point] - first));
    for (const KeyframeId id : views) map->add_observation(l, id, scene_.feature_of(id, point));
    return true;
  }

  KnownScene scene_{kPoints};
};

TEST_F(DepthJump, IsTheSizeOfWhatIsMadeOfAStep) {
  for (const double size : {0.1, 0.5, 1.0, 2.0}) {
    const std::optional<double> jump = depth_jump(map_made(size, kPoints), 2, {0});
    ASSERT_TRUE(jump) << size;
    EXPECT_NEAR(*jump / size, 1, 0.15) << size;
  }
}

TEST_F(DepthJump, SaysWhichStepsAreOfAnotherSize) {
  EXPECT_FALSE(makes_depths_jump(map_made(1, kPoints), 2, {0}));
  EXPECT_FALSE(makes_depths_jump(map_made(0.8, kPoints), 2, {0}));
  EXPECT_TRUE(makes_depths_jump(map_made(0.4, kPoints), 2, {0}));
  EXPECT_FALSE(makes_depths_jump(map_made(5, kPoints), 2, {0})) << "seen through branches";
  EXPECT_TRUE(makes_depths_jump(map_made(20, kPoints), 2, {0}));
}

// The known points are left of the middle, what is made right of it.
TEST_F(DepthJump, WhatLiesPastAnEdgeIsNoWorldOfAnotherSize) {
  Map map;
  for (int view = 0; view < 2; ++view) add(view, &map);
  const auto is_left = [&](int point) {
    const int feature = scene_.feature_of(0, point);
    return feature >= 0 && map.keyframe(0)->image->set.features[feature].pixel.x() < 320;
  };
  for (int p = 0; p < kPoints; ++p) {
    if (is_left(p)) add_point(p, 1, {0, 1}, &map);
  }
  add(2, &map);
  for (int p = 0; p < kPoints; ++p) {
    if (!is_left(p)) add_point(p, 0.4, {0, 2}, &map);
  }
  EXPECT_FALSE(makes_depths_jump(map, 2, {0}));
}

TEST_F(DepthJump, AFewPointsSayNothing) {
  EXPECT_FALSE(depth_jump(map_made(0.1, 9), 2, {0}));
  EXPECT_FALSE(depth_jump(map_made(0.1, kPoints), 2, {1})) << "the second view sees none of them";
}

}  // namespace
}  // namespace mono_pose_tracker
