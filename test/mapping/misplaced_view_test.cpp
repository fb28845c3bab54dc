#include "mono_pose_tracker/mapping/misplaced_view.h"

#include <gtest/gtest.h>

#include <vector>

#include "mono_pose_tracker/common/angles.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kKeyframes = 12, kPoints = 150;

// A camera that goes to the side and comes back. From the middle on the map has landmarks of its own, but for
// a share that ties the two parts, and they and its poses are beside the place where they belong.
class MisplacedViewTest : public testing::Test {
 protected:
  Map map_with(const Rigid3& wrong_from_right, double tied, int first_frame = 0) {
    Random random(9);
    const SyntheticScene scene = box_scene(kPoints, random);
    Map map;
    std::vector<LandmarkId> before, after;
    for (const Eigen::Vector3d& x : scene.x_in_map) {
      before.push_back(map.add_landmark(x));
      after.push_back(after.size() < tied * kPoints ? before.back() : map.add_landmark(wrong_from_right * x));
    }
    for (int k = 0; k < kKeyframes; ++k) {
      const bool is_after = k >= kKeyframes / 2;
      const int step = is_after ? kKeyframes - 1 - k : k;
      const Rigid3 camera_from_map = camera_at({0.15 * step, 0, 0}, -2.0 * step * kDegree);
      std::vector<int> point_of;
      const Frame frame = synthetic_frame(scene, camera_, camera_from_map, 0.5, k, random, &point_of);
      const Rigid3 pose = is_after ? camera_from_map * wrong_from_right.inverse() : camera_from_map;
      const KeyframeId id = map.add_keyframe(first_frame + k, k * 100000000, pose, frame.image);
      for (std::size_t f = 0; f < point_of.size(); ++f) {
        map.add_observation((is_after ? after : before)[point_of[f]], id, static_cast<int>(f));
      }
    }
    return map;
  }

  MisplacedView worst_of(const Map& map, int threads = 1) const {
    return most_misplaced_view(map, MatchOptions(), threads);
  }

  const Rigid3 beside_ = camera_at({0.4, 0, 0}, 0);
  const CameraModel camera_ = synthetic_camera();
};

TEST_F(MisplacedViewTest, ARightMapHasNone) {
  // One part: none is asked.
  EXPECT_EQ(worst_of(map_with(Rigid3(), 1)).frame_index, -1);
  // What stands twice in its right place is no more than that: two parts, each where it belongs.
  const MisplacedView twice = worst_of(map_with(Rigid3(), 0));
  EXPECT_GE(twice.frame_index, 0);
  EXPECT_LT(twice.share(), MisplacedView::kOfAWrongMap / 3);
}

TEST_F(MisplacedViewTest, APartBesideItsPlaceIsSeen) {
  const MisplacedView worst = worst_of(map_with(beside_, 0));
  EXPECT_TRUE(worst.is_significant());
  EXPECT_GT(worst.share(), 3 * MisplacedView::kOfAWrongMap);
  // The one of the way there, the other of the way back.
  EXPECT_NE(worst.frame_index < kKeyframes / 2, worst.other_frame_index < kKeyframes / 2);
}

// As identical doors do, which are seen one after the other.
TEST_F(MisplacedViewTest, WhatLooksAlikeInOnePartIsAnotherThing) {
  EXPECT_TRUE(worst_of(map_with(beside_, 0.2)).is_significant());
  EXPECT_EQ(worst_of(map_with(beside_, 0.6)).frame_index, -1);
}

// A box whose two sides are printed alike, of which a camera that goes round it sees the one and the other.
TEST_F(MisplacedViewTest, AnotherThingLikeItIsNone) {
  const Rigid3 back{Eigen::Quaterniond(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitY())),
                    Eigen::Vector3d(0, 0, 9)};
  EXPECT_FALSE(worst_of(map_with(back, 0)).is_significant());
}

TEST_F(MisplacedViewTest, IsNoneWhereSoManyAreChance) {
  MisplacedView view;
  view.landmarks = 200;
  view.elsewhere = 30;
  EXPECT_TRUE(view.is_significant());
  view.elsewhere = 19;
  EXPECT_FALSE(view.is_significant());
  view.landmarks = 80;
  view.elsewhere = 8;
  EXPECT_FALSE(view.is_significant());
}

// Frames of earlier runs come before 0.
TEST_F(MisplacedViewTest, WhatWasMovedBetweenTwoRunsIsNone) {
  EXPECT_TRUE(worst_of(map_with(beside_, 0, -kKeyframes)).is_significant());
  EXPECT_FALSE(worst_of(map_with(beside_, 0, -kKeyframes / 2)).is_significant());
}

TEST_F(MisplacedViewTest, AnEmptyMapTellsNothing) { EXPECT_EQ(worst_of(Map()).frame_index, -1); }

TEST_F(MisplacedViewTest, AnyNumberOfThreadsFindsTheSame) {
  const Map map = map_with(beside_, 0);
  const MisplacedView one = worst_of(map), many = worst_of(map, 3);
  EXPECT_EQ(one.frame_index, many.frame_index);
  EXPECT_EQ(one.elsewhere, many.elsewhere);
}

}  // namespace
}  // namespace mono_pose_tracker
