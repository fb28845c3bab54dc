#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "common/random.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/two_view_problem.h"

namespace mono_pose_tracker {

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
