#include "mono_pose_tracker/mapping/still_landmarks.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/two_bodies.h"

namespace mono_pose_tracker {
namespace {

constexpr int kHeadPoints = 150, kKeyframes = 6;
constexpr double kNoise = 0.5;  // px

// Of a head that turns, and of a shirt that stands still and of which each keyframe has landmarks of its own,
// which agree with what it sees, at the head's distance.
Map map_of_head_and_shirt(int shirt_points, int first_frame = 0) {
  Random random(3);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene head = box(kHeadPoints, {0, 0, 0}, {0.5, 0.6, 0.5}, random);
  const SyntheticScene shirt =
      box(shirt_points, {0, 0.9, 3}, {1, 0.2, 0.1}, random);  // in the camera's frame
  Map map;
  std::vector<LandmarkId> of_head;
  for (const Eigen::Vector3d& x : head.x_in_map) of_head.push_back(map.add_landmark(x));
  for (int k = 0; k < kKeyframes; ++k) {
    const Rigid3 camera_from_head = TwoBodies::camera_from_head(k);
    std::vector<int> head_point, shirt_point;
    FeatureSet both =
        synthetic_frame(head, camera, camera_from_head, kNoise, k, random, &head_point).image->set;
    const FeatureSet rest =
        synthetic_frame(shirt, camera, Rigid3(), kNoise, k, random, &shirt_point).image->set;
    if (shirt_points > 0) {
      both.features.insert(both.features.end(), rest.features.begin(), rest.features.end());
      cv::vconcat(both.descriptors.clone(), rest.descriptors, both.descriptors);
    }
    both.bearings.clear();
    const cv::Mat image(camera.height(), camera.width(), CV_8UC1, cv::Scalar(128));
    const KeyframeId id = map.add_keyframe(first_frame + k, k, camera_from_head,
                                           make_image_features(std::move(both), image, camera));
    for (std::size_t f = 0; f < head_point.size(); ++f)
      map.add_observation(of_head[head_point[f]], id, static_cast<int>(f));
    for (std::size_t f = 0; f < shirt_point.size(); ++f) {
      const LandmarkId l = map.add_landmark(camera_from_head.inverse() * shirt.x_in_map[shirt_point[f]]);
      map.add_observation(l, id, static_cast<int>(head_point.size() + f));
    }
  }
  return map;
}

StillLandmarks still_in(const Map& map, int threads = 1) {
  return still_landmarks(map, match_in_time(map, MatchOptions(), 1), MatchOptions(), threads);
}

TEST(StillLandmarks, ARightMapHasNone) {
  const StillLandmarks still = still_in(map_of_head_and_shirt(0));
  EXPECT_GT(still.matches, 100);
  EXPECT_LT(still.share(), StillLandmarks::kOfARightMap);
  EXPECT_FALSE(still.is_significant());
}

TEST(StillLandmarks, AShirtThatStandsStillBelowAHeadIsSeen) {
  const StillLandmarks still = still_in(map_of_head_and_shirt(20));
  EXPECT_GT(still.share(), 2 * StillLandmarks::kMostOfARightMap);
  EXPECT_TRUE(still.is_significant());
}

// Frames of earlier runs come before 0.
TEST(StillLandmarks, AreSeenInAMapThatWasLoadedAsWell) {
  EXPECT_TRUE(still_in(map_of_head_and_shirt(20, -100)).is_significant());
}

TEST(StillLandmarks, AreNoneWhereSoManyAreChance) {
  StillLandmarks still;
  still.still = StillLandmarks::kMinStill;
  still.matches = 100;
  EXPECT_TRUE(still.is_significant());
  still.matches = 10000;
  EXPECT_FALSE(still.is_significant());
  still.still = StillLandmarks::kMinStill - 1;
  still.matches = 50;
  EXPECT_FALSE(still.is_significant());
}

TEST(StillLandmarks, AFewPointsTellNothing) {
  EXPECT_FALSE(still_in(map_of_head_and_shirt(1)).is_significant());
  EXPECT_FALSE(still_in(Map()).is_significant());
}

TEST(StillLandmarks, AnyNumberOfThreadsCountsTheSame) {
  const Map map = map_of_head_and_shirt(20);
  const StillLandmarks one = still_in(map), many = still_in(map, 3);
  EXPECT_EQ(one.matches, many.matches);
  EXPECT_EQ(one.still, many.still);
}

}  // namespace
}  // namespace mono_pose_tracker
