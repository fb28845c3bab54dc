#pragma once

#include <cmath>

#include "common/rotation.h"
#include "robust_estimators.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {

// 1296 px span 45 degrees, the front of the box.
const double kFocalPx = 648 / std::tan(22.5 * kDegree);
constexpr double kNoisePx = 1;
constexpr double kThresholdPx = 2;

inline Eigen::Vector3d disturbed(const Eigen::Vector3d& bearing, double noise_px, Random& random) {
  Eigen::Vector3d pixel = bearing / bearing.z();
  pixel.x() += noise_px / kFocalPx * random.normal();
  pixel.y() += noise_px / kFocalPx * random.normal();
  return pixel.normalized();
}

/// Anywhere in the image.
inline Eigen::Vector3d random_bearing(Random& random) {
  const double half = 648 / kFocalPx;
  return Eigen::Vector3d(random.uniform(-half, half), random.uniform(-half, half), 1).normalized();
}

/// Camera, thresholds and the types of OpenCV.
inline void complete(Matches* matches) {
  const double centre = 648;
  matches->camera = cv::Matx33d(kFocalPx, 0, centre, 0, kFocalPx, centre, 0, 0, 1);
  matches->threshold_px = kThresholdPx;
  matches->threshold = kThresholdPx / kFocalPx;
  const auto project = [centre](const Eigen::Vector3d& b) {
    return cv::Point2d(centre + kFocalPx * b.x() / b.z(), centre + kFocalPx * b.y() / b.z());
  };
  for (const Eigen::Vector3d& b : matches->bearings1) matches->image1.push_back(project(b));
  for (const Eigen::Vector3d& b : matches->bearings2) matches->image2.push_back(project(b));
  for (const Eigen::Vector3d& x : matches->points) matches->object.emplace_back(x.x(), x.y(), x.z());
}

/// What the camera of two views does, and what it looks at.
enum class TwoViewScene {
  kGeneral,  // a box as deep as wide, turned by 10 degrees
  kPlanar,   // a hundredth as deep
  kForward,  // a box as deep as wide at distance 4, neared by 1: each epipolar line passes the image's centre
};

inline TwoViewProblem<1> two_view_problem(TwoViewScene scene, Random& random) {
  TwoViewProblem<1> problem = box_problem<1>(random, scene == TwoViewScene::kPlanar ? 0.01 : 1.0);
  if (scene == TwoViewScene::kForward) {
    problem.second_from_first = Rigid3(Eigen::Quaterniond::Identity(), -Eigen::Vector3d::UnitZ());
    problem.bearings2[0] = (problem.second_from_first * problem.x_in_first[0]).normalized();
  }
  return problem;
}

/// Outliers match a random place of the second image.
inline Matches two_view_matches(TwoViewScene scene, int count, double outlier_ratio, Random& random) {
  Matches matches;
  for (int i = 0; i < count; ++i) {
    const TwoViewProblem<1> problem = two_view_problem(scene, random);
    matches.truth = problem.second_from_first;
    const bool is_outlier = random.uniform() < outlier_ratio;
    matches.is_inlier.push_back(!is_outlier);
    matches.bearings1.push_back(disturbed(problem.bearings1[0], kNoisePx, random));
    matches.bearings2.push_back(is_outlier ? random_bearing(random)
                                           : disturbed(problem.bearings2[0], kNoisePx, random));
  }
  complete(&matches);
  return matches;
}

/// A box seen from a random side; outliers are seen at a random place of the image.
inline Matches pose_matches(double depth_by_width, int count, double outlier_ratio, Random& random) {
  Matches matches;
  const Rigid3 map_from_camera(random_rotation(random), 3 * random_direction(random));
  matches.truth = map_from_camera.inverse();
  for (int i = 0; i < count; ++i) {
    const auto problem = box_problem<1>(random, depth_by_width);
    const bool is_outlier = random.uniform() < outlier_ratio;
    matches.is_inlier.push_back(!is_outlier);
    matches.points.push_back(map_from_camera * problem.x_in_first[0]);
    matches.bearings1.push_back(is_outlier ? random_bearing(random)
                                           : disturbed(problem.bearings1[0], kNoisePx, random));
  }
  complete(&matches);
  return matches;
}

}  // namespace mono_pose_tracker
