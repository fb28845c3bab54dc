#include "mapping/off_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/angles.h"
#include "support/add_view.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kTurnKeyframes = 16;
constexpr double kCameraDistance = 5;  // of the camera

bool none_is_left_out(KeyframeId, int) { return false; }

// From the front of the head, which has turned by yaw.
Rigid3 camera_round_head(double yaw) {
  const Rigid3 camera_from_front(Eigen::Quaterniond::Identity(), {0, 0, kCameraDistance});
  const Rigid3 front_from_head(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())),
                               {0, 0, 0});
  return camera_from_front * front_from_head;
}

// Points of a head of radius 1, then of a chest below it, about the axis of its turn.
SyntheticScene head_and_chest(int of_head, int of_chest, Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < of_head; ++i) {
    const double angle = random.uniform(-60, 60) * kDegree;
    points.emplace_back(std::sin(angle), random.uniform(-1, 0.8), -std::cos(angle));
  }
  for (int i = 0; i < of_chest; ++i) {
    points.emplace_back(random.uniform(-0.5, 0.5), random.uniform(1.1, 1.7), random.uniform(-0.2, 0));
  }
  return SyntheticScene(points, random);
}

// The head turns by 40 degrees; the chest does not, but sways by so much and back. The map has a landmark for
// each point.
Map head_map(int of_head, int of_chest, double sway, bool chest_turns = false) {
  Random random(3);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = head_and_chest(of_head, of_chest, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kTurnKeyframes; ++k) {
    const double phase = static_cast<double>(k) / (kTurnKeyframes - 1);
    const Rigid3 camera_from_map = camera_round_head((40 * phase - 20) * kDegree);
    SyntheticScene now = scene;
    for (int i = of_head; i < of_head + of_chest && !chest_turns; ++i) {
      const Eigen::Vector3d swayed =
          scene.x_in_map[i] + Eigen::Vector3d(sway * std::sin(2 * M_PI * phase), 0, 0);
      now.x_in_map[i] = camera_from_map.inverse() * (camera_round_head(0) * swayed);
    }
    add_view(now, camera, camera_from_map, 0.4, k, ids, random, &map);
  }
  return map;
}

KeyframeFeatures off_body(const Map& map, int threads = 1) {
  return features_off_body(map, MatchOptions(), none_is_left_out, threads);
}

// Of the keyframes' features that are of these points, the share that is off the body.
double flagged(const Map& map, const KeyframeFeatures& off, LandmarkId first, LandmarkId end) {
  int all = 0, count = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l < first || l >= end) continue;
      ++all;
      count += off.at(id)[f];
    }
  }
  return static_cast<double>(count) / all;
}

TEST(OffBody, AChestThatSwaysBelowAHeadThatTurnsIs) {
  const Map map = head_map(200, 80, 0.06);  // by 7 px
  const KeyframeFeatures off = off_body(map);
  ASSERT_EQ(off.size(), map.keyframes().size());
  EXPECT_GT(flagged(map, off, 200, 280), 0.9);
  EXPECT_LT(flagged(map, off, 0, 200), 0.05);
}

TEST(OffBody, WhatTurnsWithTheHeadIsNot) { EXPECT_TRUE(off_body(head_map(200, 80, 0, true)).empty()); }

// Then the poses may be the chest's.
TEST(OffBody, MoreThanHalfIsNot) { EXPECT_TRUE(off_body(head_map(60, 200, 0.06)).empty()); }

TEST(OffBody, IsTheSameForAnyNumberOfThreads) {
  const Map map = head_map(200, 80, 0.06);
  EXPECT_EQ(off_body(map, 1), off_body(map, 3));
}

TEST(OffBody, AnEmptyMapHasNone) { EXPECT_TRUE(off_body(Map()).empty()); }

}  // namespace
}  // namespace mono_pose_tracker
