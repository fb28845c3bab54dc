#include "tracking/bootstrapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kNoise = 0.5;  // px, of a SIFT feature

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) / kDegree;
}

// The camera moves sideways around the scene's centre, 4 units away, one step for each frame.
Rigid3 on_the_way(int frame) {
  const double angle = 1.5 * kDegree * frame;
  return camera_at({4 * std::sin(angle), 0.02 * frame, 4 - 4 * std::cos(angle)}, angle);
}

class BootstrapperTest : public testing::Test {
 protected:
  Frame frame(const SyntheticScene& scene, const Rigid3& camera_from_map) {
    return synthetic_frame(scene, camera_, camera_from_map, kNoise, next_index_++, random_);
  }

  // Adds frames along the path until there is a map.
  BootstrapReport run(const SyntheticScene& scene, int max_frames) {
    BootstrapReport report;
    for (int i = 0; i < max_frames && !report.map; ++i)
      report = bootstrapper_.add(frame(scene, on_the_way(i)));
    return report;
  }

  // Compares the poses of the map's views with the truth, up to scale.
  void expect_right(const InitialMap& map) {
    ASSERT_GE(map.views.size(), 3u);
    EXPECT_GE(map.points.size(), 25u);
    const Rigid3 map_from_first = map.views[0].camera_from_map.inverse();
    const Rigid3 truth_from_first = on_the_way(static_cast<int>(map.views[0].frame.index)).inverse();
    for (std::size_t v = 1; v < map.views.size(); ++v) {
      const Rigid3 found = map.views[v].camera_from_map * map_from_first;
      const Rigid3 truth = on_the_way(static_cast<int>(map.views[v].frame.index)) * truth_from_first;
      EXPECT_LT(rotation_angle_between(found.rotation, truth.rotation) / kDegree, 1) << "view " << v;
      EXPECT_LT(angle_deg(found.inverse().translation, truth.inverse().translation), 6) << "view " << v;
    }
  }

  Random random_{11};
  CameraModel camera_ = synthetic_camera();
  Bootstrapper bootstrapper_{TrackerOptions(), camera_};
  std::int64_t next_index_ = 0;
};

TEST_F(BootstrapperTest, FirstFrameIsTheReference) {
  const BootstrapReport report = bootstrapper_.add(frame(box_scene(300, random_), camera_at({0, 0, 0})));
  EXPECT_EQ(report.reason, Reason::kFirstFrame);
  EXPECT_FALSE(report.map);
}

TEST_F(BootstrapperTest, FewFeaturesStartNoMap) {
  const SyntheticScene scene = box_scene(20, random_);
  for (int i = 0; i < 3; ++i) {
    const BootstrapReport report = bootstrapper_.add(frame(scene, on_the_way(i)));
    EXPECT_EQ(report.reason, Reason::kTooFewFeatures);
    EXPECT_NE(report.text.find(" 40 needed"), std::string::npos) << report.text;
    EXPECT_FALSE(report.map);
  }
}

TEST_F(BootstrapperTest, StillCameraHasTooLittleParallax) {
  const SyntheticScene scene = box_scene(300, random_);
  for (int i = 0; i < 40; ++i) {
    const BootstrapReport report = bootstrapper_.add(frame(scene, camera_at({0, 0, 0})));
    ASSERT_FALSE(report.map) << "frame " << i;
    if (i == 0) continue;
    EXPECT_EQ(report.reason, Reason::kLowParallax);
    EXPECT_NE(report.text.find("too little parallax"), std::string::npos) << report.text;
  }
  EXPECT_FALSE(bootstrapper_.unconfirmed().map);
}

TEST_F(BootstrapperTest, PureRotationMakesNoMap) {
  const SyntheticScene scene = box_scene(600, random_);
  for (int i = 0; i < 30; ++i) {
    const BootstrapReport report = bootstrapper_.add(frame(scene, camera_at({0, 0, 0}, 0.6 * kDegree * i)));
    ASSERT_FALSE(report.map) << "frame " << i;
    if (i == 0) continue;
    EXPECT_TRUE(report.reason == Reason::kRotationOnly || report.reason == Reason::kLowParallax)
        << "frame " << i << ": " << report.text;
  }
  EXPECT_FALSE(bootstrapper_.unconfirmed().map);
}

TEST_F(BootstrapperTest, SceneWithDepthGivesTheRightMap) {
  const BootstrapReport report = run(box_scene(300, random_), 20);
  ASSERT_TRUE(report.map) << report.text;
  EXPECT_EQ(report.reason, Reason::kOk);
  expect_right(*report.map);
}

TEST_F(BootstrapperTest, PlaneGivesTheRightMapNotTheSecondSolution) {
  for (int trial = 0; trial < 5; ++trial) {
    bootstrapper_.reset();
    next_index_ = 0;
    const BootstrapReport report = run(plane_scene(300, random_), 30);
    ASSERT_TRUE(report.map) << "trial " << trial << ": " << report.text;
    expect_right(*report.map);
  }
}

// A walk on a roof: a far town, whose rays intersect or not by noise, and a near railing.
TEST_F(BootstrapperTest, WhatIsFarAwayTellsTheTurnAndTheNearTheWay) {
  const auto turning = [](int frame) { return camera_at({0.06 * frame, 0, 0}, -2 * kDegree * frame); };
  int maps = 0;
  for (int trial = 0; trial < 20; ++trial) {
    bootstrapper_.reset();
    next_index_ = 0;
    std::vector<Eigen::Vector3d> x_in_map;
    for (int i = 0; i < 200; ++i) {
      const double z = i < 150 ? random_.uniform(150, 1000) : random_.uniform(3, 6);
      x_in_map.emplace_back(z * random_.uniform(-0.9, 0.6), z * random_.uniform(i < 150 ? -0.2 : 0.1, 0.4),
                            z);
    }
    const SyntheticScene scene(x_in_map, random_);
    BootstrapReport report;
    for (int i = 0; i < 12 && !report.map; ++i) report = bootstrapper_.add(frame(scene, turning(i)));
    if (!report.map) continue;
    ++maps;
    const InitialMap::View& first = report.map->views.front();
    const InitialMap::View& last = report.map->views.back();
    const Rigid3 found = last.camera_from_map * first.camera_from_map.inverse();
    const Rigid3 truth =
        turning(static_cast<int>(last.frame.index)) * turning(static_cast<int>(first.frame.index)).inverse();
    EXPECT_LT(rotation_angle_between(found.rotation, truth.rotation) / kDegree, 1) << "trial " << trial;
    EXPECT_LT(angle_deg(found.inverse().translation, truth.inverse().translation), 30) << "trial " << trial;
  }
  EXPECT_GE(maps, 5);
}

TEST_F(BootstrapperTest, NoMapBeforeAThirdView) {
  const SyntheticScene scene = box_scene(300, random_);
  bootstrapper_.add(frame(scene, on_the_way(0)));
  const BootstrapReport report = bootstrapper_.add(frame(scene, on_the_way(6)));
  EXPECT_FALSE(report.map);
  EXPECT_EQ(report.reason, Reason::kAwaitingConfirmation) << report.text;
  // Without a third view the pair is used.
  const BootstrapReport pair = bootstrapper_.unconfirmed();
  ASSERT_TRUE(pair.map) << pair.text;
  ASSERT_EQ(pair.map->views.size(), 2u);
  const Rigid3 found = pair.map->views[1].camera_from_map * pair.map->views[0].camera_from_map.inverse();
  const Rigid3 truth = on_the_way(6) * on_the_way(0).inverse();
  EXPECT_LT(rotation_angle_between(found.rotation, truth.rotation) / kDegree, 1);
}

TEST_F(BootstrapperTest, ReferenceLostFromViewIsReplaced) {
  bootstrapper_.add(frame(box_scene(300, random_), camera_at({0, 0, 0})));
  const SyntheticScene scene = box_scene(300, random_);
  const BootstrapReport lost = bootstrapper_.add(frame(scene, on_the_way(0)));
  EXPECT_EQ(lost.reason, Reason::kTooFewMatches) << lost.text;
  BootstrapReport report;
  for (int i = 1; i < 20 && !report.map; ++i) report = bootstrapper_.add(frame(scene, on_the_way(i)));
  ASSERT_TRUE(report.map) << report.text;
  EXPECT_EQ(report.map->views.front().frame.index, 1) << "not the frame that was lost";
}

}  // namespace
}  // namespace mono_pose_tracker
