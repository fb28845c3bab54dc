#include "mono_pose_tracker/mapping/depth_reversal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono_pose_tracker/common/angles.h"
#include "support/add_view.h"
#include "support/synthetic_head.h"

namespace mono_pose_tracker {
namespace {

constexpr int kTurns = 8;
constexpr double kStep = 4 * kDegree;  // the object turns, from one keyframe to the next

// A head of half a unit that turns 6 units away.
Map head_map(double noise_px) {
  Random random(3);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = synthetic_head(150, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kTurns; ++k) {
    Rigid3 camera_from_map = before_turned_head(k * kStep);
    camera_from_map.translation.x() = 0.02 * k;
    add_view(scene, camera, camera_from_map, noise_px, k, ids, random, &map);
  }
  return map;
}

// Rotation vector from the first to the last keyframe.
Eigen::Vector3d turned(const Map& map) {
  const Rigid3 last_from_first = map.keyframes().rbegin()->second.camera_from_map *
                                 map.keyframes().begin()->second.camera_from_map.inverse();
  const Eigen::AngleAxisd turn(last_from_first.rotation);
  return turn.angle() * turn.axis();
}

TEST(DepthReversal, AReversedMapTurnsTheOtherWayAndLooksNearlyTheSame) {
  Map map = head_map(0);
  const Eigen::Vector3d before = turned(map);
  reverse_depth(1, &map);
  EXPECT_LT(turned(map).normalized().dot(before.normalized()), -0.9);
  EXPECT_NEAR(turned(map).norm(), before.norm(), 2 * kDegree);  // it also moves a little
  double sum2 = 0;
  int count = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
      sum2 += reprojection_error(*keyframe.image, static_cast<int>(f),
                                 keyframe.camera_from_map * landmark->x_in_map)
                  .squaredNorm();
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(sum2 / count), 6);  // of 100 px: perspective
}

TEST(DepthReversal, AReversedMapIsSetRight) {
  for (const double stretch : {1.0, 0.4, 0.2}) {  // less than one: too deep, and turns too little
    Map map = head_map(0.3);
    const Eigen::Vector3d truth = turned(map);
    reverse_depth(stretch, &map);
    BundleOptions bundle;
    EXPECT_TRUE(correct_depth_reversal(bundle, 0.05, &map)) << stretch;
    bundle.max_iterations = 50;
    EXPECT_LT((turned(map) - truth).norm(), 3 * kDegree) << stretch;
  }
}

// The object turns by 28 degrees: plain. A reversed map is no better than the right one beside it.
TEST(DepthReversal, EvidenceTellsARightMapFromAWrongOne) {
  const Map map = head_map(0.3);
  EXPECT_GT(depth_evidence(BundleOptions(), map), kMinDepthEvidence);
  Map reversed = map;
  reverse_depth(1, &reversed);
  EXPECT_LT(depth_evidence(BundleOptions(), reversed), 0);
}

TEST(DepthReversal, ARightMapStaysAsItIs) {
  Map map = head_map(0.3);
  const Eigen::Vector3d truth = turned(map);
  EXPECT_TRUE(is_narrow(map));
  EXPECT_FALSE(correct_depth_reversal(BundleOptions(), 0.05, &map));
  EXPECT_EQ(turned(map), truth);
}

}  // namespace
}  // namespace mono_pose_tracker
