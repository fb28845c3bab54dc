#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

constexpr double kNoBound = std::numeric_limits<double>::infinity();
constexpr double kPixel = 0.785398 / 1296;  // rad: 1296 px span 45 degrees

/// A box at distance 4 whose front subtends 45 degrees, turned about its centre between the views (issue of
/// the paper).
struct TwoViewScene {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  std::vector<Eigen::Vector3d> points_in_first;
  std::vector<char> is_inlier;
  Rigid3 second_from_first;
};

inline TwoViewModel model_of(const Rigid3& second_from_first) {
  return {second_from_first.rotation_matrix(), second_from_first.translation.normalized()};
}

struct TwoViewSceneOptions {
  int num_points = 500;
  double outlier_ratio = 0;
  double depth_over_width = 1.0;  // 0.01: almost planar
  double turn = 10 * kDegree;
  double noise = kPixel;  // rad, each component
};

inline Eigen::Vector3d add_noise(const Eigen::Vector3d& bearing, double sigma, Random* random) {
  const Eigen::Vector3d across = bearing.unitOrthogonal();
  return (bearing + sigma * random->normal() * across + sigma * random->normal() * bearing.cross(across))
      .normalized();
}

inline Eigen::Vector3d random_bearing(Random* random) {
  const double half = std::tan(22.5 * kDegree);
  return Eigen::Vector3d(random->uniform(-half, half), random->uniform(-half, half), 1).normalized();
}

inline TwoViewScene make_two_view_scene(const TwoViewSceneOptions& options, std::uint64_t seed) {
  Random random(seed);
  TwoViewScene scene;
  const double half = 4 * std::tan(22.5 * kDegree);
  const double depth = 2 * half * options.depth_over_width;
  const Eigen::Vector3d center(0, 0, 4 + depth / 2);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(options.turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
  scene.second_from_first = Rigid3(turn, center - turn * center);
  const int outliers = static_cast<int>(std::lround(options.outlier_ratio * options.num_points));
  for (int i = 0; i < options.num_points; ++i) {
    const Eigen::Vector3d point(random.uniform(-half, half), random.uniform(-half, half),
                                random.uniform(4, 4 + depth));
    scene.points_in_first.push_back(point);
    scene.is_inlier.push_back(i >= outliers);
    scene.bearings1.push_back(add_noise(point.normalized(), options.noise, &random));
    scene.bearings2.push_back(
        i < outliers ? random_bearing(&random)
                     : add_noise((scene.second_from_first * point).normalized(), options.noise, &random));
  }
  return scene;
}

inline double rotation_error(const Rigid3& a, const Rigid3& b) {
  return rotation_angle_between(a.rotation, b.rotation);
}

inline double direction_error(const Rigid3& a, const Rigid3& b) {
  return std::atan2(a.translation.cross(b.translation).norm(), a.translation.dot(b.translation));
}

}  // namespace mono_pose_tracker
