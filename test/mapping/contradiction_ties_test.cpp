#include "mapping/contradiction_ties.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/mapper.h"
#include "support/add_view.h"
#include "support/skyline.h"

namespace mono_pose_tracker {
namespace {

constexpr int kTornAt = 5;

// All keyframes see the skyline; of what is near those from kTornAt on see landmarks of their own.
struct TornSkyline : SkylineWalk {
  Eigen::Vector3d moved_by{0.3, 0.3, 0};

  // From kTornAt on the map has all that is near shifted, and the camera with it; of what is near the last
  // `that_move` have really moved, another way.
  void add_views(const Eigen::Vector3d& shift, int that_move) {
    SyntheticScene after = scene;
    for (int p = kFarPoints + kNearPoints - that_move; p < kFarPoints + kNearPoints; ++p)
      after.x_in_map[p] += moved_by;
    std::vector<LandmarkId> ids_before, ids_after;
    for (int p = 0; p < kFarPoints + kNearPoints; ++p) {
      ids_before.push_back(map.add_landmark(scene.x_in_map[p]));
      ids_after.push_back(p < kFarPoints ? ids_before.back() : map.add_landmark(after.x_in_map[p] + shift));
    }
    for (int v = 0; v < kViews; ++v) {
      add_view(v < kTornAt ? scene : after, camera, pose(v), 0.5, v, v < kTornAt ? ids_before : ids_after,
               random, &map);
      if (v >= kTornAt) map.set_pose(v, pose(v) * Rigid3(Eigen::Quaterniond::Identity(), -shift));
    }
    map.check();
  }

  MatchesInTime matches() const { return match_in_time(map, MatchOptions(), 1); }
};

double step_before(const Map& map, int view) {
  return (map.keyframe(view)->center_in_map() - map.keyframe(view - 1)->center_in_map()).norm();
}

// Where it is torn the two sides become one, and the camera's steps equal again.
void expect_healed(const MatchesInTime& matches, Mapper* mapper) {
  EXPECT_EQ(mapper->correct_contradicted(matches), (std::set<KeyframeId>{kTornAt - 1, kTornAt}));
  mapper->map().check();
  EXPECT_EQ(count_contradictions(mapper->map(), matches), 0);
  EXPECT_NEAR(step_before(mapper->map(), kTornAt) / step_before(mapper->map(), kTornAt - 1), 1, 0.1);
}

TEST(ContradictionTies, WhatIsInAMapTwiceBecomesOne) {
  TornSkyline skyline;
  skyline.add_views({0.15, 0.05, 0}, 0);
  Mapper mapper(skyline.options, skyline.camera);
  mapper.restore(skyline.map, 0);
  const MatchesInTime matches = skyline.matches();
  ASSERT_EQ(count_contradictions(mapper.map(), matches), 1);
  ASSERT_GT(step_before(mapper.map(), kTornAt), 3 * TornSkyline::kStep);
  expect_healed(matches, &mapper);
}

// The last image before the tear has little of what is near in the map; the first after it has all.
TEST(ContradictionTies, WhatTheLaterOfTwoHasInTheMapTiesThemAsWell) {
  TornSkyline skyline;
  skyline.add_views({0.15, 0.05, 0}, 0);
  const Keyframe& last = *skyline.map.keyframe(kTornAt - 1);
  const std::vector<LandmarkId> seen = last.landmark_of_feature;
  constexpr int kKept = 8;
  int near = 0;
  for (const LandmarkId id : seen) {
    if (skyline.map.landmark(id)->x_in_map.norm() < 1000 && ++near > kKept)
      skyline.map.remove_observation(id, last.id);
  }
  const MatchesInTime matches = skyline.matches();
  const Keyframe &first = *skyline.map.keyframe(kTornAt - 1), &second = *skyline.map.keyframe(kTornAt);
  const std::vector<Match>& between = matches[kTornAt - 1];
  ASSERT_FALSE(contradiction_between(skyline.map, first, second, between).is_significant());
  ASSERT_TRUE(contradiction_between(skyline.map, second, first, turned_round(between)).is_significant());
  Mapper mapper(skyline.options, skyline.camera);
  mapper.restore(skyline.map, 0);
  expect_healed(matches, &mapper);
}

// Before a skyline as well: no pose explains what stays and what has moved.
TEST(ContradictionTies, WhatHasMovedStaysTwo) {
  TornSkyline skyline;
  skyline.add_views({0, 0, 0}, TornSkyline::kNearPoints / 2);
  const MatchesInTime matches = skyline.matches();
  ASSERT_EQ(count_contradictions(skyline.map, matches), 1);
  const auto is_left_out = [](KeyframeId, int) { return false; };
  EXPECT_TRUE(tie_across_contradictions(skyline.options, matches, is_left_out, &skyline.map).empty());
}

// Along the camera's own way, so that one motion between the two images explains it: but no map does.
TEST(ContradictionTies, AMapThatIsNoBetterWithTiesStaysAsItWas) {
  TornSkyline skyline;
  skyline.moved_by = {0.3, 0, 0};
  skyline.add_views({0, 0, 0}, TornSkyline::kNearPoints / 2);
  const MatchesInTime matches = skyline.matches();
  const auto is_left_out = [](KeyframeId, int) { return false; };
  Map tied = skyline.map;
  ASSERT_FALSE(tie_across_contradictions(skyline.options, matches, is_left_out, &tied).empty());
  ASSERT_LT(tied.landmarks().size(), skyline.map.landmarks().size());
  Mapper mapper(skyline.options, skyline.camera);
  mapper.restore(skyline.map, 0);
  EXPECT_TRUE(mapper.correct_contradicted(matches).empty());
  EXPECT_EQ(mapper.map().landmarks().size(), skyline.map.landmarks().size());
  for (const auto& [id, keyframe] : skyline.map.keyframes()) {
    EXPECT_EQ(mapper.map().keyframe(id)->camera_from_map.translation, keyframe.camera_from_map.translation);
  }
}

TEST(ContradictionTies, WhatWasLoadedStays) {
  TornSkyline skyline;
  skyline.add_views({0.15, 0.05, 0}, 0);
  const MatchesInTime matches = skyline.matches();
  skyline.map.shift_frame_indices(-TornSkyline::kViews);
  const auto is_left_out = [](KeyframeId, int) { return false; };
  EXPECT_TRUE(tie_across_contradictions(skyline.options, matches, is_left_out, &skyline.map).empty());
  EXPECT_EQ(count_contradictions(skyline.map, matches), 0);
}

TEST(ContradictionTies, WhatWasLeftOutTiesNothing) {
  TornSkyline skyline;
  skyline.add_views({0.15, 0.05, 0}, 0);
  const auto is_near = [&](KeyframeId id, int feature) {
    const Keyframe& keyframe = *skyline.map.keyframe(id);
    return (keyframe.camera_from_map * skyline.map.landmark(keyframe.landmark_of_feature[feature])->x_in_map)
               .norm() < 1000;
  };
  EXPECT_TRUE(tie_across_contradictions(skyline.options, skyline.matches(), is_near, &skyline.map).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
