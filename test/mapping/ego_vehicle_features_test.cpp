#include "mapping/ego_vehicle_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/independent_motion.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kViews = 8;

// A hand-held camera that moves past a wall of points, with fixed features in its images.
class EgoVehicleFeatures : public testing::Test {
 protected:
  // fixed: points observed by the first views_with views, each relative to its own frame.
  Map map_with(const SyntheticScene& fixed, int views_with = kViews) {
    const SyntheticScene wall = box_scene(300, random_);
    Map map;
    for (int k = 0; k < kViews; ++k) {
      const Eigen::AngleAxisd turned(k % 2 == 0 ? 0 : 0.08, Eigen::Vector3d(0.8, 0.6, 0));
      const Rigid3 camera_from_wall(Eigen::Quaterniond(turned), {-0.12 * k, 0.01 * k, 0});
      FeatureSet both = synthetic_frame(wall, camera_, camera_from_wall, 0.3, k, random_).image->set;
      if (k < views_with) {
        const FeatureSet own = synthetic_frame(fixed, camera_, Rigid3(), 0.3, k, random_).image->set;
        both.features.insert(both.features.end(), own.features.begin(), own.features.end());
        cv::vconcat(both.descriptors.clone(), own.descriptors, both.descriptors);
      }
      both.bearings.clear();
      map.add_keyframe(
          k, k, camera_from_wall,
          make_image_features(std::move(both), cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)), camera_));
    }
    return map;
  }

  // Two lines of text at the upper and the lower edge, centred.
  SyntheticScene words(int features) {
    std::vector<Eigen::Vector3d> x;
    for (int i = 0; i < features; ++i)
      x.emplace_back(random_.uniform(-0.2, 0.2), (i % 2 == 0 ? -1 : 1) * random_.uniform(0.36, 0.38), 1);
    return SyntheticScene(x, random_);
  }

  IndependentMotion sample(const Map& map, bool camera_goes_through) const {
    return sample_independent_motion(map, MatchOptions(), ransac_of_two_px(camera_), camera_goes_through,
                                     false, 1);
  }

 private:
  Random random_{7};
  CameraModel camera_ = synthetic_camera();
};

TEST_F(EgoVehicleFeatures, WordsInTheImagesOfACameraThatGoesOnAreNoObject) {
  const Map map = map_with(words(150));
  EXPECT_TRUE(sample(map, false).is_comparable());
  EXPECT_FALSE(sample(map, true).exists());
}

TEST_F(EgoVehicleFeatures, AStandstillInFewImagesIsAnObject) {
  EXPECT_TRUE(sample(map_with(words(150), kViews / 2), true).exists());
}

TEST_F(EgoVehicleFeatures, WhatIsFixedInAGreatPartOfTheImagesMayBeABackground) {
  std::vector<Eigen::Vector3d> x;
  Random random(9);
  for (int i = 0; i < 300; ++i) x.emplace_back(random.uniform(-0.5, 0.2), random.uniform(-0.4, 0.4), 1);
  EXPECT_TRUE(sample(map_with(SyntheticScene(x, random)), true).is_comparable());
}

TEST_F(EgoVehicleFeatures, TheRestOfTheMatchesStays) {
  const Map map = map_with(words(60));
  std::vector<RegisteredImage> images;
  for (const auto& entry : map.keyframes()) images.push_back(registered_image(entry.second));
  std::vector<PairMotions> motions(1);
  const RansacOptions ransac = ransac_of_two_px(synthetic_camera());
  motions[0] = compare_motions(images[0], images[1], MatchOptions(), ransac);
  const std::size_t before = motions[0].matches.size();
  ASSERT_TRUE(motions[0].has_other);
  exclude_ego_vehicle_features(images, {{0, 1}}, ransac, &motions);
  EXPECT_FALSE(motions[0].has_other);
  EXPECT_NEAR(static_cast<double>(before - motions[0].matches.size()), 60, 6);
  EXPECT_EQ(motions[0].obeyed.size(), motions[0].matches.size());
}

}  // namespace
}  // namespace mono_pose_tracker
