#include "mono_pose_tracker/mapping/contradiction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono_pose_tracker/common/angles.h"
#include "support/add_view.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kKeyframes = 6, kPoints = 200, kBreak = 4;

// Keyframes along a box of points; from kBreak on the left of it has been moved, and the map, which follows
// the rest, keeps no observation of what it contradicts.
Map make_map(double moved, double left_of) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kPoints, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kKeyframes; ++k) {
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree);
    SyntheticScene now = scene;
    std::vector<char> is_moved(kPoints, 0);
    for (int i = 0; i < kPoints; ++i) {
      is_moved[i] = k >= kBreak && now.x_in_map[i].x() < left_of;
      if (is_moved[i]) now.x_in_map[i].y() += moved;
    }
    std::vector<int> point_of;
    const Frame frame = synthetic_frame(now, camera, camera_from_map, 0.5, k, random, &point_of);
    const KeyframeId id = map.add_keyframe(k, k * 100000000, camera_from_map, frame.image);
    for (std::size_t f = 0; f < point_of.size(); ++f) {
      if (!is_moved[point_of[f]]) map.add_observation(ids[point_of[f]], id, static_cast<int>(f));
    }
  }
  return map;
}

Contradiction worst_of(const Map& map) {
  return worst_contradiction(map, match_in_time(map, MatchOptions(), 1));
}

TEST(Contradiction, ARightMapHasNone) {
  const Contradiction worst = worst_of(make_map(0, 0));
  EXPECT_EQ(worst.contradicting, 0);
  EXPECT_LT(worst.share(), Contradiction::kMostOfARightMap);
  EXPECT_FALSE(worst.is_significant());
}

TEST(Contradiction, APartThatGoesAnotherWayIsSeenWhereItBegins) {
  const Contradiction worst = worst_of(make_map(0.2, -0.3));  // by 27 px
  EXPECT_EQ(worst.frame_index, kBreak);
  EXPECT_GT(worst.share(), 2 * Contradiction::kOfAWrongMap);
  EXPECT_TRUE(worst.is_significant());
}

TEST(Contradiction, AFewThatMoveByThemselvesAreNone) {
  const Contradiction worst = worst_of(make_map(0.2, -1.4));
  EXPECT_LT(worst.share(), Contradiction::kMostOfARightMap);
  EXPECT_FALSE(worst.is_significant());
}

// A row of panels that look alike, of which a camera that turns sees the next where it saw one before: what
// it matches best may be the neighbour, but each one's own place is not empty.
TEST(Contradiction, ARepeatedPatternSaysNothing) {
  Random random(7);
  const CameraModel camera = synthetic_camera();
  SyntheticScene scene = box_scene(kPoints, random);
  constexpr int kPattern = 60;
  for (int i = 0; i < kPattern; ++i) {  // in pairs, 0.3 apart
    if (i % 2) scene.x_in_map[i] = scene.x_in_map[i - 1] + Eigen::Vector3d(0.3, 0, 0);
    if (i % 2) scene.descriptors.row(i - 1).copyTo(scene.descriptors.row(i));
  }
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < 2; ++k) {
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, 0);
    SyntheticScene seen = scene;
    for (int i = 0; i < kPattern; ++i) {  // the first view sees one of each pair well, the second the other
      seen.descriptors.at<std::uint8_t>(i, 0) = i % 2 == k ? 0 : 60;
    }
    add_view(seen, camera, camera_from_map, 0.2, k, ids, random, &map);
  }
  const Contradiction worst = worst_of(map);
  EXPECT_GE(worst.matches, 30);
  EXPECT_EQ(worst.contradicting, 0);
}

TEST(Contradiction, OneInTenCountsWhereItIsNoChance) {
  Contradiction pair;
  pair.matches = 258, pair.contradicting = 28;  // a map of a head and of the shoulders below it
  EXPECT_TRUE(pair.is_significant());
  pair.matches = 239, pair.contradicting = 14;  // right ones
  EXPECT_FALSE(pair.is_significant());
  pair.matches = 60, pair.contradicting = 8;
  EXPECT_FALSE(pair.is_significant());
  pair.contradicting = 9;  // one in seven
  EXPECT_TRUE(pair.is_significant());
  EXPECT_FALSE(Contradiction().is_significant());
}

TEST(Contradiction, ChanceAmongAFewDoesNotHideWhatIsNone) {
  Contradiction few, many;
  few.matches = 60, few.contradicting = 8;      // .133, and not significant
  many.matches = 500, many.contradicting = 60;  // .12, and it is
  EXPECT_TRUE(many.is_worse_than(few));
  EXPECT_FALSE(few.is_worse_than(many));
  few.contradicting = 9;
  EXPECT_TRUE(few.is_worse_than(many)) << "by its share, where both are";
}

TEST(Contradiction, ThereIsNothingToCompareInAnEmptyMap) { EXPECT_EQ(worst_of(Map()).frame_index, -1); }

}  // namespace
}  // namespace mono_pose_tracker
