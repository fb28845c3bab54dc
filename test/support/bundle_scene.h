#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>

#include "common/statistics.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

inline CameraModel bundle_camera() {
  CameraParameters p;
  p.width = 640, p.height = 480, p.fx = p.fy = 500, p.cx = 320, p.cy = 240;
  p.distortion = {-0.2, 0.05, 0.001, -0.001, 0};
  return CameraModel(p);
}

// Cameras on an arc around a cloud of points. Every camera observes all points, with noise in px.
inline BundleProblem scene(int cameras, int points, double noise_px, std::uint64_t seed) {
  Random random(seed);
  const CameraModel model = bundle_camera();
  BundleProblem problem;
  for (int i = 0; i < cameras; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    problem.cameras.push_back({Rigid3(turn, Eigen::Vector3d(0, 0, 5)), false});
  }
  while (static_cast<int>(problem.points.size()) < points) {
    problem.points.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  }
  for (int i = 0; i < cameras; ++i) {
    for (int j = 0; j < points; ++j) {
      Eigen::Vector2d pixel;
      EXPECT_TRUE(model.project(problem.cameras[i].camera_from_map * problem.points[j], &pixel));
      pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      BundleObservation o;
      o.camera = i, o.point = j;
      o.bearing = model.bearing(pixel);
      model.project(o.bearing, &pixel, &o.pixel_from_bearing);
      problem.observations.push_back(o);
    }
  }
  return problem;
}

// Disturbs all cameras but the first, and all points, by this amount in radians and lengths.
inline void disturb(BundleProblem* problem, double amount, std::uint64_t seed) {
  Random random(seed);
  const auto noise = [&]() -> Eigen::Vector3d {
    return Eigen::Vector3d(random.normal(), random.normal(), random.normal()) * amount;
  };
  for (std::size_t i = 1; i < problem->cameras.size(); ++i) {
    Rigid3& pose = problem->cameras[i].camera_from_map;
    const Eigen::Vector3d w = noise();
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())) * pose.rotation;
    pose.translation += noise();
  }
  for (Eigen::Vector3d& x : problem->points) x += noise();
}

}  // namespace mono_pose_tracker
