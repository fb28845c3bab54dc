#include "mapping/depth_reversal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "mapping/keyframe_landmarks.h"
#include "optimization/map_adjustment.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kSignificance = 1e-3;  // QualityOptions
constexpr int kTurns = 8;
constexpr double kStep = 4 * kDegree;  // rotation of the object between keyframes

// A head of half a unit that rotates 6 units away.
Map head_map(double noise_px, int points = 150) {
  Random random(3);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = synthetic_head(points, random);
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

// The same with short tracks: every landmark is observed by a few consecutive keyframes only.
Map map_of_short_tracks(double noise_px) {
  constexpr std::size_t kViews = 3;
  Map map = head_map(noise_px);
  std::size_t next = 0;
  for (const LandmarkId id : map.landmark_ids()) {
    const std::vector<Observation> seen = map.landmark(id)->observations;
    const std::size_t first = next++ % (seen.size() - kViews + 1);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i < first || i >= first + kViews) map.remove_observation(id, seen[i].keyframe);
    }
  }
  return map;
}

void settle(Map* map) {
  BundleOptions bundle;
  bundle.max_iterations = 100;
  adjust_map(bundle, map);
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
  for (const double stretch : {1.0, 0.4, 0.2}) {  // less than one: too deep, with too little rotation
    Map map = head_map(0.3);
    const Eigen::Vector3d truth = turned(map);
    reverse_depth(stretch, &map);
    BundleOptions bundle;
    EXPECT_TRUE(correct_depth_reversal(bundle, 0.05, &map)) << stretch;
    bundle.max_iterations = 50;
    EXPECT_LT((turned(map) - truth).norm(), 3 * kDegree) << stretch;
  }
}

TEST(DepthReversal, AStretchedMapTurnsFartherTheSameWay) {
  Map map = head_map(0);
  const Eigen::Vector3d before = turned(map);
  stretch_depth(2, &map);
  EXPECT_GT(turned(map).normalized().dot(before.normalized()), 0.9);
  EXPECT_NEAR(turned(map).norm(), 2 * before.norm(), 3 * kDegree);
}

TEST(AlternativeMap, IsRuledOutWhereItCostsPlainlyMore) {
  const Map map = head_map(0.3);
  EXPECT_EQ(p_value_of(map, map), 1);
  Map worse = map;
  reverse_depth(1, &worse);
  EXPECT_LT(p_value_of(worse, map), 1e-6);
  EXPECT_EQ(p_value_of(map, worse), 1);
  EXPECT_EQ(p_value_of(worse, map, 1.01 * (cost_of(worse) / cost_of(map) - 1)), 1)
      << "however many landmarks say so";
}

TEST(AlternativeMap, LostObservationsCostAsMuchAsOutliers) {
  const Map map = head_map(0.3);
  Map fewer = map;
  const KeyframeId last = map.keyframes().rbegin()->first;
  for (const LandmarkId id : landmarks_of(*map.keyframe(last))) fewer.remove_observation(id, last);
  EXPECT_LT(p_value_of(fewer, map), 1e-6);
}

// The object rotates by 28 degrees, which gives plain evidence. A reversed map has no more evidence than the
// right one.
TEST(DepthReversal, EvidenceTellsARightMapFromAWrongOne) {
  const Map map = head_map(0.3);
  EXPECT_LT(reversal_p_value(BundleOptions(), map), kSignificance);
  Map reversed = map;
  reverse_depth(1, &reversed);
  EXPECT_GT(reversal_p_value(BundleOptions(), reversed), 0.5);
}

// A map so large that it is compared by a sample; a view at the end of the rotation has few observations.
TEST(DepthReversal, ALargeMapIsComparedAsASmallOne) {
  Map map = head_map(0.3, 900);
  const Eigen::Vector3d truth = turned(map);
  const KeyframeId last = map.keyframes().rbegin()->first;
  std::vector<LandmarkId> seen = landmarks_of(*map.keyframe(last));
  for (std::size_t i = 15; i < seen.size(); ++i) map.remove_observation(seen[i], last);
  EXPECT_LT(reversal_p_value(BundleOptions(), map), kSignificance);
  Map stays = map;
  EXPECT_FALSE(correct_depth_reversal(BundleOptions(), 0.05, &stays));
  reverse_depth(1, &map);
  EXPECT_GT(reversal_p_value(BundleOptions(), map), 0.5);
  EXPECT_TRUE(correct_depth_reversal(BundleOptions(), 0.05, &map));
  EXPECT_LT((turned(map) - truth).norm(), 3 * kDegree);
}

// Deep with little rotation: a map whose points are observed from a few sides only may converge to that.
TEST(DepthReversal, EvidenceTellsAMapThatHardlyTurns) {
  Map map = map_of_short_tracks(0.1);
  const double truth = turned(map).norm();
  settle(&map);
  EXPECT_LT(reversal_p_value(BundleOptions(), map), kSignificance);
  stretch_depth(0.1, &map);
  settle(&map);
  ASSERT_LT(turned(map).norm(), 0.5 * truth);
  EXPECT_GT(reversal_p_value(BundleOptions(), map), kSignificance);
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
