#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "bundle_cameras.h"
#include "geometry/motion_prior.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

inline Eigen::Vector3d center_of(const CameraState& camera) {
  return -camera.rotation.transpose() * camera.translation;
}

// Residual of the motion prior, and its derivatives by each camera's rotation about its centre and
// translation (as in CameraState; d center = -R^T (v x turn) - R^T d v).
struct MotionResidual {
  Eigen::Vector3d residual;
  std::array<Eigen::Matrix<double, 3, 6>, 3> by_pose;

  MotionResidual(const BundleMotion& motion, const std::vector<CameraState>& states, bool derivatives) {
    const double before = 1 / motion.seconds_before, after = 1 / motion.seconds_after;
    const std::array<double, 3> weights = {before / motion.sigma, -(before + after) / motion.sigma,
                                           after / motion.sigma};
    residual.setZero();
    for (int k = 0; k < 3; ++k) {
      const CameraState& camera = states[motion.cameras[k]];
      residual += weights[k] * center_of(camera);
      if (!derivatives) continue;
      const Eigen::Matrix3d back = weights[k] * camera.rotation.transpose();
      by_pose[k] << -back * cross_matrix(camera.moved), -back;
    }
  }
};

}  // namespace mono_pose_tracker
