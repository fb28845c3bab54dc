#include "mapping/contradicted_pose.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/mapper.h"
#include "support/add_view.h"
#include "support/skyline.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kAstrayView = 5;

// All keyframes see all, but for the astray one: it was taken to be elsewhere, and sees the skyline only.
struct Skyline : SkylineWalk {
  IsLeftOut is_left_out = [](KeyframeId, int) { return false; };

  // Of the astray one: where it was taken from and for, and what it saw there.
  void add_views(const Rigid3& seen_from, const Rigid3& taken_for, const SyntheticScene& seen) {
    std::vector<LandmarkId> all, far;
    for (int p = 0; p < kFarPoints + kNearPoints; ++p) {
      all.push_back(map.add_landmark(scene.x_in_map[p]));
      far.push_back(p < kFarPoints ? all.back() : map.add_landmark(scene.x_in_map[p]));
    }
    for (int v = 0; v < kViews; ++v) {
      const bool is_astray = v == kAstrayView;
      add_view(is_astray ? seen : scene, camera, is_astray ? seen_from : pose(v), 0.5, v,
               is_astray ? far : all, random, &map);
      if (is_astray) map.set_pose(v, taken_for);
    }
    for (int p = kFarPoints; p < kFarPoints + kNearPoints; ++p) map.remove_landmark(far[p]);
    map.check();
  }

  std::set<KeyframeId> correct() {
    const std::set<KeyframeId> moved =
        correct_contradicted_poses(options, match_in_time(map, MatchOptions(), 1), is_left_out, &map);
    map.check();
    return moved;
  }

  double off_by(int view) const {
    return (map.keyframe(view)->center_in_map() - pose(view).inverse().translation).norm();
  }

  int seen_by(KeyframeId id) const {
    int seen = 0;
    for (const LandmarkId l : map.keyframe(id)->landmark_of_feature) seen += l != kNoLandmark;
    return seen;
  }
};

Rigid3 astray() { return camera_at({0.05 * kAstrayView + 0.4, 0.2, 0}, -0.5 * kAstrayView * kDegree); }

TEST(ContradictedPose, WhatIsNearTellsWhereTheCameraWas) {
  Skyline skyline;
  skyline.add_views(Skyline::pose(kAstrayView), astray(), skyline.scene);
  const int before = skyline.seen_by(kAstrayView);
  ASSERT_GT(skyline.off_by(kAstrayView), 0.4);
  EXPECT_EQ(skyline.correct(), std::set<KeyframeId>{kAstrayView});
  EXPECT_LT(skyline.off_by(kAstrayView), 0.02);
  EXPECT_GT(skyline.seen_by(kAstrayView), before + Skyline::kNearPoints / 2);
}

TEST(ContradictedPose, WhatWasLeftOutSaysNothing) {
  Skyline skyline;
  skyline.add_views(Skyline::pose(kAstrayView), astray(), skyline.scene);
  const std::vector<LandmarkId> known = skyline.map.keyframe(kAstrayView)->landmark_of_feature;
  skyline.is_left_out = [&](KeyframeId id, int feature) {
    return id == kAstrayView && known[feature] == kNoLandmark;
  };
  EXPECT_EQ(skyline.correct().count(kAstrayView), 0u);
}

// The mapper finishes the map anew then.
TEST(ContradictedPose, TheMapIsFinishedAnew) {
  Skyline skyline;
  skyline.add_views(Skyline::pose(kAstrayView), astray(), skyline.scene);
  Mapper mapper(skyline.options, skyline.camera);
  mapper.restore(skyline.map, 0);
  const MatchesInTime matches = match_in_time(mapper.map(), MatchOptions(), 1);
  EXPECT_EQ(mapper.correct_contradicted(matches), std::set<KeyframeId>{kAstrayView});
  EXPECT_FALSE(
      worst_contradiction(mapper.map(), match_in_time(mapper.map(), MatchOptions(), 1)).is_significant());
  EXPECT_TRUE(mapper.correct_contradicted(matches).empty());
}

TEST(ContradictedPose, RightPosesStay) {
  Skyline skyline;
  skyline.add_views(Skyline::pose(kAstrayView), Skyline::pose(kAstrayView), skyline.scene);
  EXPECT_TRUE(skyline.correct().empty());
}

// In one image most of what is near has moved on: what is far, and what has not, says where the camera was.
TEST(ContradictedPose, AnotherBodysMotionIsNoPose) {
  Skyline skyline;
  const Rigid3 pose = Skyline::pose(kAstrayView), of_the_other = camera_at({0.3, 0.3, 0}, 6 * kDegree);
  SyntheticScene moved = skyline.scene;
  for (int p = Skyline::kFarPoints; p < Skyline::kFarPoints + Skyline::kNearPoints; ++p) {
    moved.x_in_map[p] = pose.inverse() * (of_the_other * moved.x_in_map[p]);
  }
  skyline.add_views(pose, pose, moved);
  ASSERT_TRUE(
      worst_contradiction(skyline.map, match_in_time(skyline.map, MatchOptions(), 1)).is_significant());
  EXPECT_TRUE(skyline.correct().empty());
  EXPECT_EQ(skyline.off_by(kAstrayView), 0);
}

TEST(ContradictedPose, OfAnEarlierRunAllStay) {
  Skyline skyline;
  skyline.add_views(Skyline::pose(kAstrayView), astray(), skyline.scene);
  skyline.map.shift_frame_indices(-Skyline::kViews);
  EXPECT_TRUE(skyline.correct().empty());
}

}  // namespace
}  // namespace mono_pose_tracker
