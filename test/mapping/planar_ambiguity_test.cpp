#include "mapping/planar_ambiguity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "common/rotation.h"
#include "geometry/triangulation.h"
#include "optimization/map_adjustment.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kSignificance = 1e-3;  // QualityOptions
constexpr int kViews = 7;
constexpr double kDepth = 4;          // of the wall, fronto-parallel
constexpr double kMinEvidence = 0.1;  // as in the mapper

RansacOptions ransac() {
  RansacOptions options;
  options.threshold = 2.0 / synthetic_camera().focal();
  return options;
}

// A wall with a box on it.
SyntheticScene wall(Random& random) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (int i = 0; i < 300; ++i) x_in_map.emplace_back(random.uniform(-2, 2), random.uniform(-2, 2), kDepth);
  for (int i = 0; i < 40; ++i) {
    x_in_map.emplace_back(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), kDepth - 0.5);
  }
  return SyntheticScene(x_in_map, random);
}

// Fronto-parallel, approaching and moving upwards without rotation.
Rigid3 pose(int k) { return camera_at(k * Eigen::Vector3d(0.02, -0.1, 0.15)); }

Map map_of(const SyntheticScene& scene, Random& random) {
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kViews; ++k) add_view(scene, synthetic_camera(), pose(k), 0.3, k, ids, random, &map);
  return map;
}

// The second planar solution for the pose of the k-th camera.
Rigid3 second_pose(int k) {
  const Rigid3 truth = pose(k);
  cv::Matx33d homography = cv::Matx33d::eye();
  for (int i = 0; i < 3; ++i) homography(i, 2) += truth.translation[i] / kDepth;
  std::vector<cv::Mat> rotations, translations, normals;
  cv::decomposeHomographyMat(homography, cv::Matx33d::eye(), rotations, translations, normals);
  Rigid3 second;
  double least = 1e9;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const cv::Matx33d r = rotations[i];
    const Eigen::Vector3d t =
        kDepth * Eigen::Vector3d(translations[i].at<double>(0), translations[i].at<double>(1),
                                 translations[i].at<double>(2));
    const Eigen::Vector3d normal(normals[i].at<double>(0), normals[i].at<double>(1),
                                 normals[i].at<double>(2));
    if (normal.z() < 0 || normal.dot(Eigen::Vector3d::UnitZ()) > 0.999) continue;  // behind, or the truth
    Eigen::Matrix3d rotation;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) rotation(a, b) = r(a, b);
    }
    if (std::abs(normal.z()) < least) {
      least = std::abs(normal.z());
      second = Rigid3(rotation, t);
    }
  }
  EXPECT_LT(least, 1e9);
  return second;
}

// Triangulates the landmarks from the poses and adjusts the map.
void settle(Map* map) {
  for (const LandmarkId l : map->landmark_ids()) {
    std::vector<Rigid3> cameras;
    std::vector<Eigen::Vector3d> bearings;
    for (const Observation& seen : map->landmark(l)->observations) {
      cameras.push_back(map->keyframe(seen.keyframe)->camera_from_map);
      bearings.push_back(map->keyframe(seen.keyframe)->image->set.bearings[seen.feature]);
    }
    Eigen::Vector3d x_in_map;
    if (cameras.size() > 1 && triangulate_multi_view(cameras, bearings, &x_in_map)) {
      map->set_position(l, x_in_map);
    } else {
      map->remove_landmark(l);
    }
  }
  adjust_map(BundleOptions(), map);
}

Map second_solution_of(Map map) {
  for (int k = 1; k < kViews; ++k) map.set_pose(k, second_pose(k));
  settle(&map);
  return map;
}

// Rotation error of the last camera relative to the first.
double turn_off(const Map& map) {
  return rotation_angle_between(map.keyframe(kViews - 1)->camera_from_map.rotation,
                                pose(kViews - 1).rotation);
}

double direction_off(const Map& map) {
  const Eigen::Vector3d center = map.keyframe(kViews - 1)->center_in_map();
  const Eigen::Vector3d truth = pose(kViews - 1).inverse().translation;
  return std::acos(center.normalized().dot(truth.normalized()));
}

TEST(PlanarAmbiguity, AMapOfTheSecondPlanarSolutionIsCorrected) {
  Random random(5);
  Map map = second_solution_of(map_of(wall(random), random));
  ASSERT_GT(turn_off(map), 5 * kDegree);  // an adjustment does not correct it
  ASSERT_GT(direction_off(map), 20 * kDegree);
  EXPECT_GT(planar_p_value(BundleOptions(), ransac(), map), 0.5);
  ASSERT_TRUE(correct_geometry(BundleOptions(), ransac(), kMinEvidence, &map));
  map.check();
  EXPECT_LT(turn_off(map), 0.5 * kDegree);
  EXPECT_LT(direction_off(map), 3 * kDegree);
  EXPECT_LT(planar_p_value(BundleOptions(), ransac(), map), kSignificance);
}

TEST(PlanarAmbiguity, ARightMapStaysAsItIs) {
  Random random(6);
  Map map = map_of(wall(random), random);
  const Rigid3 before = map.keyframe(kViews - 1)->camera_from_map;
  EXPECT_FALSE(correct_geometry(BundleOptions(), ransac(), kMinEvidence, &map));
  EXPECT_EQ(map.keyframe(kViews - 1)->camera_from_map.translation, before.translation);
  EXPECT_LT(planar_p_value(BundleOptions(), ransac(), map), kSignificance);
}

TEST(PlanarAmbiguity, AScenesDepthLeavesNoOther) {
  Random random(7);
  const SyntheticScene scene = box_scene(300, random);
  EXPECT_LT(planar_p_value(BundleOptions(), ransac(), map_of(scene, random)), 1e-6);
}

TEST(PlanarAmbiguity, TooFewCommonMatchesGiveNoAlternative) {
  Random random(8);
  const SyntheticScene scene = box_scene(40, random);
  Map map = map_of(scene, random);
  EXPECT_EQ(planar_p_value(BundleOptions(), ransac(), map), 0);
  EXPECT_FALSE(correct_geometry(BundleOptions(), ransac(), kMinEvidence, &map));
}

}  // namespace
}  // namespace mono_pose_tracker
