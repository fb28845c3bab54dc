#pragma once

#include <ceres/ceres.h>
#include <ceres/version.h>

#include <Eigen/Geometry>

#include "common/so3.h"
#include "reprojection.h"

namespace mono_pose_tracker {

// How this version of Ceres updates a pose block [qx qy qz qw tx ty tz]: by a left rotation vector w, q' =
// exp(w) q, and t' = t + v. Cost functions write their Jacobians with respect to (w, v) in the first six
// columns; the plus-Jacobian is [I; 0], so that Ceres passes them on unchanged.
inline void pose_plus(const double* x, const double* delta, double* x_plus_delta) {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  const Eigen::Quaterniond turn = exp_so3(Eigen::Map<const Eigen::Vector3d>(delta));
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (turn * q).normalized();
  for (int i = 4; i < 7; ++i) x_plus_delta[i] = x[i] + delta[i - 1];
}

inline void pose_plus_jacobian(double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
}

#if CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1)

class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(jacobian);
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Eigen::Map<const Eigen::Quaterniond> qy(y), qx(x);
    const Eigen::AngleAxisd turn(qy * qx.conjugate());
    Eigen::Map<Eigen::Vector3d> w(y_minus_x);
    w = turn.angle() * turn.axis();
    for (int i = 4; i < 7; ++i) y_minus_x[i - 1] = y[i] - x[i];
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

inline void set_pose_parameterization(double* block, ceres::Problem* problem) {
  problem->SetManifold(block, new PoseManifold);
}

#else

class PoseParameterization : public ceres::LocalParameterization {
 public:
  int GlobalSize() const override { return 7; }
  int LocalSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, x_plus_delta);
    return true;
  }
  bool ComputeJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(jacobian);
    return true;
  }
};

inline void set_pose_parameterization(double* block, ceres::Problem* problem) {
  problem->SetParameterization(block, new PoseParameterization);
}

#endif

// d residual / d (w, v) of x_in_camera = exp(w) rotated + t + v, from d residual / d x_in_camera.
template <typename Jacobian>
void pose_jacobian(const Eigen::Matrix<double, 2, 3>& dr_dx, const Eigen::Vector3d& rotated, Jacobian* j) {
  *j << by_turn(dr_dx, rotated), dr_dx, Eigen::Vector2d::Zero();
}

}  // namespace mono_pose_tracker
