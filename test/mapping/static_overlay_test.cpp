#include "mapping/static_overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "common/rotation.h"
#include "known_scene.h"

namespace mono_pose_tracker {
namespace {

constexpr int kFixed = 40;

class StaticOverlay : public testing::Test {
 protected:
  StaticOverlay() : bonnet_(pixels_as_points(), random_) {}

  // Points of a plane at depth 1 in front of the camera, for any pose.
  std::vector<Eigen::Vector3d> pixels_as_points() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < kFixed; ++i) {
      points.emplace_back(random_.uniform(-0.4, 0.4), random_.uniform(0.25, 0.35), 1);
    }
    return points;
  }

  // A keyframe's first features are the scene's, the last ones the bonnet's, which shakes by a pixel.
  void add_keyframe(const Rigid3& camera_from_map) {
    const std::int64_t index = static_cast<std::int64_t>(map_.keyframes().size());
    const Frame scene = synthetic_frame(scene_, camera_, camera_from_map, 0.3, index, random_);
    const Frame bonnet = synthetic_frame(bonnet_, camera_, Rigid3(), has_bonnet_ ? 1 : 1e6, index, random_);
    FeatureSet both = scene.image->set;
    both.bearings.clear();
    for (int f = 0; f < bonnet.image->size(); ++f) {
      both.features.push_back(bonnet.image->set.features[f]);
      both.descriptors.push_back(bonnet.image->set.descriptors.row(f));
    }
    const cv::Mat image(camera_.height(), camera_.width(), CV_8UC1, cv::Scalar(128));
    map_.add_keyframe(index, index, camera_from_map, make_image_features(std::move(both), image, camera_));
  }

  // Flags of the last of these keyframes.
  std::vector<char> last_of(int keyframes, const std::function<Rigid3(int)>& pose) {
    for (int i = 0; i < keyframes; ++i) add_keyframe(pose(i));
    FlaggedFeatures found = find_static_overlay(MapperOptions(), map_, keyframes - 1, {});
    return found[keyframes - 1];
  }

  // A camera that looks in its direction of motion.
  static Rigid3 walk(int i) { return camera_at({0.15 * i, 0.02 * i, 0.05 * i}, -2 * i * kDegree); }

  Random random_{11};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_ = box_scene(300, random_), bonnet_;
  bool has_bonnet_ = true;
  Map map_;
};

TEST_F(StaticOverlay, WhatIsFixedToTheCameraIsFound) {
  const std::vector<char> fixed = last_of(6, walk);
  ASSERT_FALSE(fixed.empty());
  const auto of_scene = fixed.end() - kFixed;
  EXPECT_GT(std::count(of_scene, fixed.end(), 1), 0.8 * kFixed);
  EXPECT_EQ(std::count(fixed.begin(), of_scene, 1), 0);
}

TEST_F(StaticOverlay, AFewViewsSayNothing) { EXPECT_TRUE(last_of(3, walk).empty()); }

TEST_F(StaticOverlay, ASceneAloneHasNone) {
  has_bonnet_ = false;
  EXPECT_TRUE(last_of(8, walk).empty());
}

// The camera moves around it and keeps it centred.
TEST_F(StaticOverlay, WhatIsKeptInTheMiddleIsAPoint) {
  has_bonnet_ = false;
  std::vector<Eigen::Vector3d> axis;
  for (int i = 0; i < 60; ++i) axis.emplace_back(0, random_.uniform(-1, 1), 4);
  scene_ = SyntheticScene(axis, random_);
  const auto round = [](int i) {
    const Rigid3 camera_from_middle(
        Eigen::Quaterniond(Eigen::AngleAxisd(4 * i * kDegree, Eigen::Vector3d::UnitY())),
        Eigen::Vector3d(0, 0, 4));
    return camera_from_middle * Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -4));
  };
  EXPECT_TRUE(last_of(8, round).empty());
}

TEST_F(StaticOverlay, WhatIsDrivenAtFromFarAwayIsAPoint) {
  has_bonnet_ = false;
  for (Eigen::Vector3d& x : scene_.x_in_map) x *= 500;
  EXPECT_TRUE(last_of(8, [](int i) { return camera_at({0, 0, 1.0 * i}); }).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
