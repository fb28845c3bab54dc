#include "mono_pose_tracker/mapping/misplaced_stretch.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "mono_pose_tracker/common/angles.h"
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
  bool ties_across = true;  // what is after it sees the landmarks that what is before it sees
};

Map map_with_misplaced(const Misplaced& misplaced) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kStretchPoints, random);
  const Rigid3 elsewhere_from_map(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY())),
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
  return misplaced_stretch(map, match_in_time(map, MatchOptions(), 1),
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

// A hand that comes before a head is no landmark of what was seen before it: none contradicts the map.
TEST(MisplacedStretch, WhatMovesOtherwiseAtItsEndsNeedsNoLandmarks) {
  Map map = map_with_misplaced({6, 9});
  for (const KeyframeId id : {6, 7, 8}) {
    const std::vector<LandmarkId> landmarks = map.keyframe(id)->landmark_of_feature;
    for (std::size_t f = 20; f < landmarks.size(); ++f) map.remove_observation(landmarks[f], id);
  }
  EXPECT_EQ(stretch_of(map), (std::set<KeyframeId>{6, 7, 8}));
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
  ASSERT_EQ(matches.size(), kStretchKeyframes - 2u);
  EXPECT_EQ(matches[5].size(), match_in_time(map, MatchOptions(), 1)[5].size());
}

}  // namespace
}  // namespace mono_pose_tracker
