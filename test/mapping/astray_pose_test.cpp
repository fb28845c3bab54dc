#include "mapping/astray_pose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/angles.h"
#include "support/skyline.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// Two keyframes of things 2 to 5 units away before a skyline at 3000 to 5000, of which the map has landmarks.
class AstrayPoseTest : public testing::Test {
 protected:
  static constexpr int kFar = 60, kNear = 160;
  static constexpr double kSceneNoise = 0.3;  // px

  AstrayPoseTest() : scene_(skyline_points(kFar, kNear, random_), random_) {
    options_.ransac = ransac_of_two_px(camera_);
    add(Rigid3(), Rigid3());
  }

  void add(const Rigid3& seen_from, const Rigid3& taken_for) {
    const auto index = static_cast<std::int64_t>(point_of_.size());
    point_of_.emplace_back();
    const Frame frame =
        synthetic_frame(scene_, camera_, seen_from, kSceneNoise, index, random_, &point_of_.back());
    map_.add_keyframe(index, frame.stamp_ns, taken_for, frame.image);
  }

  int feature_of(int view, int point) const {
    const auto& points = point_of_[view];
    const auto found = std::find(points.begin(), points.end(), point);
    return found == points.end() ? -1 : static_cast<int>(found - points.begin());
  }

  // Landmarks from one point on, seen by the first so many keyframes.
  void know(int from, int to, int views) {
    for (int p = from; p < to; ++p) {
      LandmarkId l = kNoLandmark;
      for (int v = 0; v < views; ++v) {
        if (feature_of(v, p) < 0) continue;
        if (l == kNoLandmark) l = map_.add_landmark(scene_.x_in_map[p]);
        map_.add_observation(l, v, feature_of(v, p));
      }
    }
  }

  Eigen::Vector3d center() const { return map_.keyframe(1)->center_in_map(); }

  double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return std::acos(a.normalized().dot(b.normalized())) / kDegree;
  }

  Random random_{5};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_;
  MapperOptions options_;
  Map map_;
  std::vector<std::vector<int>> point_of_;
  const Eigen::Vector3d went_{0.3, 0.05, 0.1};
};

TEST_F(AstrayPoseTest, WhatIsNearTellsWhereTheCameraWent) {
  add(camera_at(went_, 3 * kDegree), camera_at({-0.1, -0.2, 0.2}, 3 * kDegree));
  know(0, kFar, 2);
  ASSERT_GT(degrees_between(center(), went_), 60);
  EXPECT_TRUE(correct_astray_pose(options_, 1, 0, &map_));
  EXPECT_LT(degrees_between(center(), went_), 3);
  EXPECT_NEAR(center().norm(), 0.3, 1e-6) << "the skyline does not tell how far: as before";
}

TEST_F(AstrayPoseTest, AFewNearLandmarksTellHowFar) {
  add(camera_at(went_, 3 * kDegree), camera_at({-0.3, -0.6, 0.6}, 3 * kDegree));
  know(0, kFar, 2);
  know(kFar, kFar + 10, 1);
  EXPECT_TRUE(correct_astray_pose(options_, 1, 0, &map_));
  EXPECT_LT((center() - went_).norm(), 0.05 * went_.norm());
}

TEST_F(AstrayPoseTest, ARightPoseStays) {
  const Rigid3 pose = camera_at(went_, 3 * kDegree);
  add(pose, pose);
  know(0, kFar, 2);
  EXPECT_FALSE(correct_astray_pose(options_, 1, 0, &map_));
  EXPECT_EQ(center(), pose.inverse().translation);
}

// What is near moves otherwise, and is most of what is seen; the map is of what is far.
TEST_F(AstrayPoseTest, AnotherBodysMotionIsNoPose) {
  const Rigid3 pose = camera_at({0.1, 0, 0}, 8 * kDegree),
               of_the_other = camera_at({0.1, 0.3, 0}, 1 * kDegree);
  for (int p = kFar; p < kFar + kNear; ++p) {
    scene_.x_in_map[p] = pose.inverse() * (of_the_other * scene_.x_in_map[p]);
  }
  add(pose, pose);
  know(0, kFar, 2);
  EXPECT_FALSE(correct_astray_pose(options_, 1, 0, &map_));
  EXPECT_EQ(center(), pose.inverse().translation);
}

}  // namespace
}  // namespace mono_pose_tracker
