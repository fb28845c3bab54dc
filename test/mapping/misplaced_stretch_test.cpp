#include "mono_pose_tracker/mapping/misplaced_stretch.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "support/add_view.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kStretchKeyframes = 16, kStretchPoints = 200;

// Keyframes along a box of points. Those from `begin` to before `end` were put elsewhere, with points of
// their own: the box once more, where it would have to be then.
struct Misplaced {
  int begin = 0, end = 0;
  bool ties_across = true;            // what is after it sees the landmarks that what is before it sees
  Eigen::Vector3d turned{0, 0.4, 0};  // radians about an axis
  bool is_object = false;             // a column of a quarter of the box's width and height
};

Map map_with_misplaced(const Misplaced& misplaced) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  SyntheticScene scene = box_scene(kStretchPoints, random);
  if (misplaced.is_object) {
    for (Eigen::Vector3d& x : scene.x_in_map) x.head<2>() /= 4;
  }
  const Rigid3 elsewhere_from_map(
      Eigen::Quaterniond(Eigen::AngleAxisd(misplaced.turned.norm(), misplaced.turned.normalized())),
      {0.5, 0, 0});
  Map map;
  std::vector<LandmarkId> here, there, later;
  for (const Eigen::Vector3d& x : scene.x_in_map) {
    here.push_back(map.add_landmark(x));
    there.push_back(map.add_landmark(elsewhere_from_map * x));
    later.push_back(misplaced.ties_across ? here.back() : map.add_landmark(x));
  }
  for (int k = 0; k < kStretchKeyframes; ++k) {
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree);
    const bool is_there = k >= misplaced.begin && k < misplaced.end;
    add_view(scene, camera, camera_from_map, 0.5, k,
             is_there              ? there
             : k < misplaced.begin ? here
                                   : later,
             random, &map);
    if (is_there) map.set_pose(k, camera_from_map * elsewhere_from_map.inverse());
  }
  map.check();
  return map;
}

std::set<KeyframeId> stretch_of(const Map& map) {
  return misplaced_stretch(map, match_in_time(map, MatchOptions(), 1), MatchOptions(),
                           TrackerOptions().ransac(synthetic_camera().focal()));
}

TEST(MisplacedStretch, ARightMapHasNone) { EXPECT_TRUE(stretch_of(map_with_misplaced({})).empty()); }

TEST(MisplacedStretch, WhatLiesElsewhereIsFoundFromEndToEnd) {
  EXPECT_EQ(stretch_of(map_with_misplaced({6, 9})), (std::set<KeyframeId>{6, 7, 8}));
}

TEST(MisplacedStretch, WithoutItTheMapHasNone) {
  Map map = map_with_misplaced({6, 9});
  for (const KeyframeId id : {6, 7, 8}) map.remove_keyframe(id, 5);
  EXPECT_TRUE(stretch_of(map).empty());
}

// What the keyframe sees of the map, but for these features: they stay.
template <typename IsKept>
void forget_landmarks(KeyframeId id, IsKept is_kept, Map* map) {
  const std::vector<LandmarkId> landmarks = map->keyframe(id)->landmark_of_feature;
  for (std::size_t f = 0; f < landmarks.size(); ++f) {
    if (!is_kept(f)) map->remove_observation(landmarks[f], id);
  }
}

// What comes before an object is no landmark of what was seen before it: too few landmarks contradict.
// (Turned upwards: sideways all would move along its epipolar lines.)
TEST(MisplacedStretch, WhatMovesOtherwiseAtItsEndsNeedsNoLandmarks) {
  Map map = map_with_misplaced({6, 9, true, {0.15, 0, 0}, true});
  for (const KeyframeId id : {5, 6, 8, 9})
    forget_landmarks(
        id, [](std::size_t f) { return f < 20; }, &map);
  const MatchesInTime matches = match_in_time(map, MatchOptions(), 1);
  for (const KeyframeId id : {5, 8}) {
    ASSERT_FALSE(
        contradiction_both_ways(map, *map.keyframe(id), *map.keyframe(id + 1), matches[id]).is_significant());
  }
  EXPECT_EQ(stretch_of(map), (std::set<KeyframeId>{6, 7, 8}));
}

// An object of which these keyframes were put ten degrees too high. No two in a row have landmarks in common
// that would tell.
Map map_of_turned(const std::set<KeyframeId>& turned) {
  constexpr std::size_t kKept = 87, kTurns = 3;  // features, of which each keyframe keeps every third
  Misplaced none;
  none.is_object = true;
  Map map = map_with_misplaced(none);
  const Rigid3 upwards(Eigen::Quaterniond(Eigen::AngleAxisd(10 * kDegree, Eigen::Vector3d::UnitX())),
                       Eigen::Vector3d::Zero());
  for (KeyframeId id = 0; id < kStretchKeyframes; ++id) {
    const auto turn = static_cast<std::size_t>(id) % kTurns;
    forget_landmarks(
        id, [&](std::size_t f) { return f < kKept && f % kTurns == turn; }, &map);
    if (turned.count(id)) map.set_pose(id, upwards * map.keyframe(id)->camera_from_map);
  }
  return map;
}

TEST(MisplacedStretch, MovesOtherwiseBeforeAnObject) {
  EXPECT_EQ(stretch_of(map_of_turned({7})), std::set<KeyframeId>{7});
}

TEST(MisplacedStretch, MovesOtherwiseForMoreThanAQuarterOfTheWay) {
  EXPECT_EQ(stretch_of(map_of_turned({6, 7, 8, 9, 10})), (std::set<KeyframeId>{6, 7, 8, 9, 10}));
}

// What is after it shows it as well.
TEST(MisplacedStretch, ThatIsNotHealedWithoutItIsNone) {
  EXPECT_TRUE(stretch_of(map_of_turned({7, 8, 9, 10, 11, 12, 13, 14, 15})).empty());
}

// A second body is seen all along.
TEST(MisplacedStretch, ASecondBodyIsNone) {
  EXPECT_TRUE(stretch_of(map_of_turned({1, 3, 5, 7, 9, 11, 13, 15})).empty());
}

// Which of two sides is right, one break does not tell.
TEST(MisplacedStretch, AnEndIsNone) {
  EXPECT_TRUE(stretch_of(map_with_misplaced({13, kStretchKeyframes})).empty());
}

TEST(MisplacedStretch, MoreThanAQuarterIsNone) {
  EXPECT_TRUE(stretch_of(map_with_misplaced({6, 11})).empty());
}

// Nothing tells then that what is before and after it belongs together.
TEST(MisplacedStretch, WhatNothingTiesAcrossIsNone) {
  EXPECT_TRUE(stretch_of(map_with_misplaced({6, 9, false})).empty());
}

// They hold the map's frame and its scale.
TEST(MisplacedStretch, TheFirstTwoStay) { EXPECT_TRUE(stretch_of(map_with_misplaced({1, 4})).empty()); }

TEST(KnownMatches, AreThoseOfTheMapThatIsAsked) {
  Map map = map_with_misplaced({6, 9});
  KnownMatches known;
  EXPECT_EQ(known.of(map, MatchOptions(), 1).size(), kStretchKeyframes - 1u);
  EXPECT_EQ(known.of(map, MatchOptions(), 1).size(), kStretchKeyframes - 1u);
  map.remove_keyframe(6, 5);
  const MatchesInTime& matches = known.of(map, MatchOptions(), 1);
  const MatchesInTime anew = match_in_time(map, MatchOptions(), 1);
  ASSERT_EQ(matches.size(), kStretchKeyframes - 2u);
  for (std::size_t i = 0; i < anew.size(); ++i) {
    ASSERT_EQ(matches[i].size(), anew[i].size()) << i;
    for (std::size_t m = 0; m < anew[i].size(); ++m) {
      EXPECT_EQ(matches[i][m].first, anew[i][m].first);
      EXPECT_EQ(matches[i][m].second, anew[i][m].second);
    }
  }
}

}  // namespace
}  // namespace mono_pose_tracker
