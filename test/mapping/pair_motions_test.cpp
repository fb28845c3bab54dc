#include "mapping/motion_segmentation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kSecondNoise = 0.3;  // px

std::vector<Eigen::Vector3d> box_between(int points, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                                         Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < points; ++i) {
    x.emplace_back(random.uniform(low.x(), high.x()), random.uniform(low.y(), high.y()),
                   random.uniform(low.z(), high.z()));
  }
  return x;
}

// A rotating object 3 units away, in front of a table that moves with a hand-held camera.
class SecondMotionTest : public testing::Test {
 protected:
  SecondMotionTest()
      : object_(box_between(150, {-0.5, -0.6, -0.5}, {0.5, 0.6, 0.5}, random_), random_),
        rest_(box_between(80, {-2, -1.5, 4.5}, {2, 1.5, 6}, random_), random_) {}

  // The first features are the object's; the keyframe's pose is relative to the object.
  Keyframe keyframe(double yaw, const Rigid3& camera_from_rest) {
    const Rigid3 camera_from_object(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())),
                                    Eigen::Vector3d(0, 0, 3));
    const Frame object = synthetic_frame(object_, camera_, camera_from_object, kSecondNoise, 0, random_);
    const Frame rest = synthetic_frame(rest_, camera_, camera_from_rest, kSecondNoise, 0, random_);
    FeatureSet both = object.image->set;
    both.bearings.clear();
    const FeatureSet& other = rest.image->set;
    both.features.insert(both.features.end(), other.features.begin(), other.features.end());
    if (other.size() > 0) cv::vconcat(object.image->set.descriptors, other.descriptors, both.descriptors);
    object_features_ = object.image->size();
    Keyframe keyframe;
    keyframe.camera_from_map = camera_from_object;
    keyframe.image = make_image_features(
        std::move(both), cv::Mat(camera_.height(), camera_.width(), CV_8UC1, cv::Scalar(128)), camera_);
    keyframe.landmark_of_feature.assign(keyframe.image->size(), kNoLandmark);
    return keyframe;
  }

  SecondMotion find(const Keyframe& first, const Keyframe& second) const {
    MotionSegmentationOptions options;
    options.ransac = ransac_of_two_px(camera_);
    const PairMotions pair = compare_motions(registered_image(first), registered_image(second), options);
    return second_motion_in(pair, *first.image, *second.image);
  }

  Random random_{7};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene object_, rest_;
  int object_features_ = 0;  // of the last keyframe
};

TEST_F(SecondMotionTest, ABackgroundBehindACameraInTheHandIsTold) {
  const Keyframe first = keyframe(0, Rigid3());
  const Keyframe second = keyframe(5 * kDegree, camera_at({0.15, 0.1, 0.02}, 1 * kDegree));
  const SecondMotion found = find(first, second);
  ASSERT_EQ(static_cast<int>(found.of_second.size()), second.image->size());
  ASSERT_EQ(static_cast<int>(found.of_first.size()), first.image->size());
  int right = 0, wrong = 0;
  for (int f = 0; f < second.image->size(); ++f) {
    (f >= object_features_ ? right : wrong) += found.of_second[f];
  }
  EXPECT_GT(right, 0.8 * (second.image->size() - object_features_));
  EXPECT_LT(wrong, 0.08 * object_features_);  // those among the background features
}

TEST_F(SecondMotionTest, ThereIsNoneWhereAllIsOneObject) {
  rest_ = SyntheticScene({}, random_);
  const Keyframe first = keyframe(0, Rigid3()), second = keyframe(5 * kDegree, Rigid3());
  EXPECT_TRUE(find(first, second).of_first.empty());
}

// A match of two wheels of a car agrees with a rotation that is too large for descriptors to match.
TEST_F(SecondMotionTest, WhatCouldNotBeSeenAgainIsNone) {
  const Eigen::Vector3d middle(0, 0, 5.25);
  const auto turned = [&](double angle) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    return Rigid3(turn, middle - turn * middle);
  };
  const Keyframe first = keyframe(0, Rigid3());
  EXPECT_FALSE(find(first, keyframe(5 * kDegree, turned(40 * kDegree))).of_first.empty());
  EXPECT_TRUE(find(first, keyframe(5 * kDegree, turned(160 * kDegree))).of_first.empty());
}

TEST_F(SecondMotionTest, ThingsThatMoveEachItsOwnWayAreNone) {
  const Keyframe first = keyframe(0, Rigid3());
  for (Eigen::Vector3d& x : rest_.x_in_map) {
    x += Eigen::Vector3d(random_.uniform(-0.5, 0.5), random_.uniform(-0.5, 0.5), 0);
  }
  EXPECT_TRUE(find(first, keyframe(5 * kDegree, Rigid3())).of_first.empty());
}

}  // namespace
}  // namespace mono_pose_tracker
