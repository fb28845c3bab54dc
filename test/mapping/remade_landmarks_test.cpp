#include "mapping/remade_landmarks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/angles.h"
#include "support/add_view.h"
#include "support/synthetic_head.h"

namespace mono_pose_tracker {
namespace {

constexpr int kHeadViews = 10, kHeadPoints = 400;
constexpr double kTurn = 3 * kDegree;  // the head turns, from one keyframe to the next
constexpr double kHeadNoise = 0.1;     // px

// The poses say that it turns `share` times as far as it does. Each landmark is seen by two keyframes only:
// the map has nothing that would speak against its poses.
Map make_map(double share) {
  Random random(3);
  const SyntheticScene scene = synthetic_head(kHeadPoints, random);
  const CameraModel camera = synthetic_camera();
  Map map;
  std::vector<LandmarkId> ids(kHeadPoints);
  for (int k = 0; k < kHeadViews; ++k) {
    for (int i = 0; i < kHeadPoints && k % 2 == 0; ++i) ids[i] = map.add_landmark(scene.x_in_map[i]);
    add_view(scene, camera, before_turned_head(k * kTurn), kHeadNoise, k, ids, random, &map);
    map.set_pose(k, before_turned_head(share * k * kTurn));
  }
  return map;
}

double total_turn(const Map& map) {
  return map.keyframe(0)->camera_from_map.rotation.angularDistance(
      map.keyframe(kHeadViews - 1)->camera_from_map.rotation);
}

bool nothing_is_left_out(KeyframeId, int) { return false; }

constexpr double kTruth = (kHeadViews - 1) * kTurn;

TEST(RemadeLandmarks, SetAMapRightThatAgreesWithItself) {
  for (const double share : {0.75, 0.9, 1.15}) {
    Map map = make_map(share);
    ASSERT_GT(std::abs(total_turn(map) - kTruth), 2 * kDegree);
    EXPECT_TRUE(remake_landmarks(BundleOptions(), MatchOptions(), 15, nothing_is_left_out, &map)) << share;
    EXPECT_NEAR(total_turn(map), kTruth, 0.5 * kDegree) << share;
    EXPECT_GT(map.landmarks().size(), 0.8 * kHeadPoints) << share;
    map.check();
  }
}

TEST(RemadeLandmarks, LeaveARightMapAsItIs) {
  Map map = make_map(1);
  const std::size_t landmarks = map.landmarks().size();
  EXPECT_FALSE(remake_landmarks(BundleOptions(), MatchOptions(), 15, nothing_is_left_out, &map));
  EXPECT_EQ(total_turn(map), total_turn(make_map(1)));
  EXPECT_EQ(map.landmarks().size(), landmarks);
}

TEST(RemadeLandmarks, MustHoldEveryKeyframe) {
  Map map = make_map(0.75);
  const double before = total_turn(map);
  EXPECT_FALSE(remake_landmarks(BundleOptions(), MatchOptions(), kHeadPoints + 1, nothing_is_left_out, &map));
  const auto is_of_fifth = [](KeyframeId keyframe, int) { return keyframe == 5; };
  EXPECT_FALSE(remake_landmarks(BundleOptions(), MatchOptions(), 15, is_of_fifth, &map));
  EXPECT_EQ(total_turn(map), before);
}

TEST(RemadeLandmarks, AreNoneOfWhatIsLeftOut) {
  Map map = make_map(0.75);
  const auto is_left_out = [](KeyframeId, int feature) { return feature % 4 == 0; };
  EXPECT_TRUE(remake_landmarks(BundleOptions(), MatchOptions(), 15, is_left_out, &map));
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); f += 4) {
      EXPECT_EQ(keyframe.landmark_of_feature[f], kNoLandmark);
    }
  }
}

TEST(RemadeLandmarks, OfAnEmptyMapAreNone) {
  Map map;
  EXPECT_FALSE(remake_landmarks(BundleOptions(), MatchOptions(), 15, nothing_is_left_out, &map));
}

}  // namespace
}  // namespace mono_pose_tracker
