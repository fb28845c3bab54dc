#include "optimization/map_adjustment.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kKeyframes = 6;

// Keyframes on a line before a scene, everything where it belongs, seen without noise.
class MapAdjustment : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<LandmarkId> ids;
    for (const Eigen::Vector3d& x : scene_.x_in_map) ids.push_back(map_.add_landmark(x));
    for (int i = 0; i < kKeyframes; ++i) {
      std::vector<int> point_of;
      const Frame frame = synthetic_frame(scene_, camera_, pose(i), 0, i, random_, &point_of);
      const KeyframeId id = map_.add_keyframe(i, i, pose(i), frame.image);
      for (std::size_t f = 0; f < point_of.size(); ++f)
        map_.add_observation(ids[point_of[f]], id, static_cast<int>(f));
    }
  }

  static Rigid3 pose(int i) { return camera_at({0.2 * i, 0, 0}); }

  // The last two keyframes and every point off by some per cent of the depth.
  void disturb() {
    for (int i = kKeyframes - 2; i < kKeyframes; ++i) {
      Rigid3 camera_from_map = map_.keyframe(i)->camera_from_map;
      camera_from_map.translation +=
          0.03 * Eigen::Vector3d(random_.normal(), random_.normal(), random_.normal());
      map_.set_pose(i, camera_from_map);
    }
    for (const LandmarkId l : map_.landmark_ids()) {
      map_.set_position(l, map_.landmark(l)->x_in_map +
                               0.02 * Eigen::Vector3d(random_.normal(), random_.normal(), random_.normal()));
    }
  }

  double worst_center() const {
    double worst = 0;
    for (int i = 0; i < kKeyframes; ++i) {
      worst = std::max(worst, (map_.keyframe(i)->center_in_map() - pose(i).inverse().translation).norm());
    }
    return worst;
  }

  // Of those that the last two keyframes see.
  double worst_point() const {
    double worst = 0;
    for (std::size_t i = 0; i < scene_.x_in_map.size(); ++i) {
      const Landmark& landmark = *map_.landmark(static_cast<LandmarkId>(i));
      if (landmark.observations.size() < 2 || landmark.observations.back().keyframe < kKeyframes - 2)
        continue;
      worst = std::max(worst, (landmark.x_in_map - scene_.x_in_map[i]).norm());
    }
    return worst;
  }

  static BundleOptions exact() {
    BundleOptions options;
    options.function_tolerance = 1e-14;
    options.max_iterations = 100;
    return options;
  }

  Random random_{3};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_ = box_scene(300, random_);
  Map map_;
};

TEST_F(MapAdjustment, FreeKeyframesAndAllTheySeeComeBackToTheTruth) {
  disturb();
  EXPECT_GT(worst_center(), 0.02);
  EXPECT_TRUE(adjust_keyframes(exact(), {4, 5}, 10, 1000, &map_).usable);
  EXPECT_LT(worst_center(), 1e-5);
  EXPECT_LT(worst_point(), 1e-4);
}

TEST_F(MapAdjustment, AFewLandmarksHoldThePosesAndTheOthersFollow) {
  disturb();
  EXPECT_TRUE(adjust_keyframes(exact(), {4, 5}, 10, 60, &map_).usable);
  EXPECT_LT(worst_center(), 1e-5);
  EXPECT_LT(worst_point(), 1e-3) << "four steps for the points, once the poses are right";
}

// Two of five fixed keyframes: what the others saw must not be forgotten.
TEST_F(MapAdjustment, ALandmarkThatOneKeyframeOfTheWindowSeesDoesNotFloat) {
  std::vector<LandmarkId> lonely;
  for (const LandmarkId l : map_.landmark_ids()) {
    const std::vector<Observation> observations = map_.landmark(l)->observations;
    if (observations.size() != kKeyframes || lonely.size() == 20) continue;
    for (int i = 1; i < kKeyframes - 1; ++i) map_.remove_observation(l, i);
    lonely.push_back(l);
  }
  ASSERT_EQ(lonely.size(), 20u);
  // So that keyframe 0 is not among the two that see most.
  int removed = 0;
  for (const LandmarkId l : map_.landmark_ids()) {
    if (map_.landmark(l)->observations.size() == kKeyframes && ++removed <= 60) map_.remove_observation(l, 0);
  }
  disturb();
  map_.set_pose(kKeyframes - 2, pose(kKeyframes - 2));
  EXPECT_TRUE(adjust_keyframes(exact(), {5}, 2, 1000, &map_).usable);
  for (const LandmarkId l : lonely) {
    EXPECT_LT((map_.landmark(l)->x_in_map - scene_.x_in_map[l]).norm(), 1e-3) << l;
  }
}

// The matrix of four cameras alone would take 4,600 multiplications, of three 2,000.
TEST_F(MapAdjustment, AnIterationIsNoMoreWorkThanAllowed) {
  disturb();
  std::map<KeyframeId, Eigen::Vector3d> before;
  for (const auto& [id, keyframe] : map_.keyframes()) before[id] = keyframe.center_in_map();
  BundleOptions options = exact();
  options.max_iteration_work = 6000;
  EXPECT_TRUE(adjust_keyframes(options, {2, 3, 4, 5}, 10, 1000, &map_).usable);
  EXPECT_EQ(map_.keyframe(2)->center_in_map(), before[2]) << "the oldest stays";
  EXPECT_NE(map_.keyframe(5)->center_in_map(), before[5]);
  EXPECT_LT(worst_center(), 1e-3) << "fifty landmarks of each hold the poses";
}

TEST_F(MapAdjustment, KeyframesThatAreNotFreeStay) {
  disturb();
  const Rigid3 before = map_.keyframe(1)->camera_from_map;
  adjust_keyframes(exact(), {4, 5}, 10, 60, &map_);
  EXPECT_EQ(map_.keyframe(1)->camera_from_map.translation, before.translation);
}

}  // namespace
}  // namespace mono_pose_tracker
