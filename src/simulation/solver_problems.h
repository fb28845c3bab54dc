#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

inline Eigen::Vector3d random_direction(Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

inline Eigen::Quaterniond random_rotation(Random& random) {
  return Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
}

/// A pair of cameras and N points in front of both; bearings are unit, without noise.
template <int N>
struct TwoViewProblem {
  Rigid3 second_from_first;
  std::array<Eigen::Vector3d, N> x_in_first, bearings1, bearings2;
};

/// Points in a box at distance 4 whose front subtends 45 degrees, turned by `angle` about its centre round
/// the y axis.
template <int N>
TwoViewProblem<N> box_problem(Random& random, double depth_by_width,
                              double angle = 10 * 3.14159265358979 / 180) {
  const double width = 2 * 4 * 0.41421356237309503;  // 2 * 4 * tan(22.5 degrees)
  const double depth = depth_by_width * width;
  const Eigen::Vector3d centre(0, 0, 4 + depth / 2);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
  TwoViewProblem<N> problem;
  problem.second_from_first = Rigid3(turn, centre - turn * centre);
  for (int i = 0; i < N; ++i) {
    const Eigen::Vector3d offset(random.uniform(-width, width) / 2, random.uniform(-width, width) / 2,
                                 random.uniform(-depth, depth) / 2);
    problem.x_in_first[i] = centre + offset;
    problem.bearings1[i] = problem.x_in_first[i].normalized();
    problem.bearings2[i] = (problem.second_from_first * problem.x_in_first[i]).normalized();
  }
  return problem;
}

/// Turns of up to 30 degrees, unit translation along `direction`, points at depths 2 to 10 in a 90 degree
/// view.
template <int N>
TwoViewProblem<N> motion_problem(Random& random, const Eigen::Vector3d& direction) {
  TwoViewProblem<N> problem;
  const Eigen::AngleAxisd turn(random.uniform(0, 0.5), random_direction(random));
  problem.second_from_first = Rigid3(Eigen::Quaterniond(turn), direction);
  for (int i = 0; i < N; ++i) {
    Eigen::Vector3d& x = problem.x_in_first[i];
    do {
      const double depth = random.uniform(2, 10);
      x = Eigen::Vector3d(random.uniform(-depth, depth), random.uniform(-depth, depth), depth);
    } while ((problem.second_from_first * x).z() < 0.1);
    problem.bearings1[i] = x.normalized();
    problem.bearings2[i] = (problem.second_from_first * x).normalized();
  }
  return problem;
}

/// Turns of up to 30 degrees and a translation of the given length in any direction, points in a cube round
/// distance 4 that subtends about 45 degrees: short, the camera nearly only turns.
template <int N>
TwoViewProblem<N> near_rotation_problem(Random& random, double baseline) {
  const double half = 4 * 0.41421356237309503;  // 4 * tan(22.5 degrees)
  TwoViewProblem<N> problem;
  const Eigen::AngleAxisd turn(random.uniform(0, 0.5), random_direction(random));
  problem.second_from_first = Rigid3(Eigen::Quaterniond(turn), baseline * random_direction(random));
  for (int i = 0; i < N; ++i) {
    Eigen::Vector3d& x = problem.x_in_first[i];
    do {
      x = Eigen::Vector3d(random.uniform(-half, half), random.uniform(-half, half),
                          random.uniform(4 - half, 4 + half));
    } while ((problem.second_from_first * x).z() < 0.1);
    problem.bearings1[i] = x.normalized();
    problem.bearings2[i] = (problem.second_from_first * x).normalized();
  }
  return problem;
}

/// Distance of two matrices of unit norm whose sign is free.
inline double distance_up_to_sign(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

/// A camera in a map and three points in front of it; bearings are unit, in the camera's frame, without
/// noise.
struct PoseProblem {
  Rigid3 camera_from_map;
  std::array<Eigen::Vector3d, 3> bearings, points;
};

/// Points in a 90 degree view at depths 1 to 10, given in a map turned and shifted at random.
inline PoseProblem random_pose_problem(Random& random) {
  PoseProblem problem;
  problem.camera_from_map = Rigid3(random_rotation(random), 3 * random_direction(random));
  const Rigid3 map_from_camera = problem.camera_from_map.inverse();
  for (int i = 0; i < 3; ++i) {
    const double depth = random.uniform(1, 10);
    const Eigen::Vector3d x(random.uniform(-depth, depth), random.uniform(-depth, depth), depth);
    problem.points[i] = map_from_camera * x;
    problem.bearings[i] = x.normalized();
  }
  return problem;
}

/// Two points in a 90 degree view at depths 1 to 10 and one between them, off their line by a share of
/// their distance: a flat triangle.
inline PoseProblem flat_triangle_problem(Random& random, double height) {
  PoseProblem problem = random_pose_problem(random);
  const Eigen::Vector3d side = problem.points[2] - problem.points[0];
  const Eigen::Vector3d across = side.cross(random_direction(random)).normalized();
  problem.points[1] = problem.points[0] + random.uniform(0.1, 0.9) * side + height * side.norm() * across;
  problem.bearings[1] = (problem.camera_from_map * problem.points[1]).normalized();
  return problem;
}

/// Three points on a circle, seen from the cylinder over it: a double solution.
inline PoseProblem danger_cylinder_problem(Random& random) {
  PoseProblem problem;
  problem.camera_from_map = Rigid3(random_rotation(random), 3 * random_direction(random));
  const Rigid3 map_from_circle(random_rotation(random), 3 * random_direction(random));
  const auto on_circle = [&](double height) {
    const double angle = random.uniform(0, 2 * 3.14159265358979);
    return map_from_circle * Eigen::Vector3d(std::cos(angle), std::sin(angle), height);
  };
  for (Eigen::Vector3d& point : problem.points) point = on_circle(0);
  const Eigen::Vector3d centre = on_circle(random.uniform(0.5, 5));
  problem.camera_from_map.translation = -(problem.camera_from_map.rotation * centre);
  for (int i = 0; i < 3; ++i) {
    problem.bearings[i] = (problem.camera_from_map * problem.points[i]).normalized();
  }
  return problem;
}

}  // namespace mono_pose_tracker
