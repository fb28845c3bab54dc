#pragma once

#include <ceres/ceres.h>
#include <ceres/version.h>

#include <Eigen/Geometry>

#include "mono_pose_tracker/common/so3.h"
#include "reprojection.h"

namespace mono_pose_tracker {

// The one place that knows how this Ceres moves a pose block [qx qy qz qw tx ty tz]: by a left rotation
// vector w, q' = exp(w) q, and t' = t + v. The Jacobians of cost functions are written with respect to (w, v)
// in their first six columns; the plus-Jacobian is [I; 0], so that Ceres passes them on unchanged.
// Rows of the identity: the tangent's coordinates in (w, v), less the one that is held.
using TangentRows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, 6, 6>;

inline TangentRows tangent_rows(int held) {
  TangentRows rows(held < 0 ? 6 : 5, 6);
  rows.setZero();
  int row = 0;
  for (int i = 0; i < 6; ++i) {
    if (i != held) rows(row++, i) = 1;
  }
  return rows;
}

inline void pose_plus(const double* x, const double* delta, const TangentRows& rows, double* x_plus_delta) {
  const Eigen::Matrix<double, 6, 1> d =
      rows.transpose() * Eigen::Map<const Eigen::VectorXd>(delta, rows.rows());
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  const Eigen::Quaterniond turn = exp_so3(d.head<3>());
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (turn * q).normalized();
  for (int i = 4; i < 7; ++i) x_plus_delta[i] = x[i] + d[i - 1];
}

inline void pose_plus_jacobian(const TangentRows& rows, double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 7, Eigen::Dynamic, Eigen::RowMajor>> j(jacobian, 7, rows.rows());
  j.setZero();
  j.topRows<6>() = rows.transpose();
}

// A pose that may move in all six directions or, to hold the scale of a problem, in all but one coordinate of
// (w, v).
#if CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1)

class PoseManifold : public ceres::Manifold {
 public:
  explicit PoseManifold(int held) : rows_(tangent_rows(held)) {}
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return static_cast<int>(rows_.rows()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, rows_, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(rows_, jacobian);
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Eigen::Map<const Eigen::Quaterniond> qy(y), qx(x);
    const Eigen::AngleAxisd turn(qy * qx.conjugate());
    Eigen::Matrix<double, 6, 1> d;
    d.head<3>() = turn.angle() * turn.axis();
    for (int i = 4; i < 7; ++i) d[i - 1] = y[i] - x[i];
    Eigen::Map<Eigen::VectorXd>(y_minus_x, rows_.rows()) = rows_ * d;
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>> j(jacobian, rows_.rows(), 7);
    j.setZero();
    j.leftCols<6>() = rows_;
    return true;
  }

 private:
  const TangentRows rows_;
};

inline void set_pose_parameterization(double* block, int held, ceres::Problem* problem) {
  problem->SetManifold(block, new PoseManifold(held));
}

#else

class PoseParameterization : public ceres::LocalParameterization {
 public:
  explicit PoseParameterization(int held) : rows_(tangent_rows(held)) {}
  int GlobalSize() const override { return 7; }
  int LocalSize() const override { return static_cast<int>(rows_.rows()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, rows_, x_plus_delta);
    return true;
  }
  bool ComputeJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(rows_, jacobian);
    return true;
  }

 private:
  const TangentRows rows_;
};

inline void set_pose_parameterization(double* block, int held, ceres::Problem* problem) {
  problem->SetParameterization(block, new PoseParameterization(held));
}

#endif

// d residual / d (w, v) of x_in_camera = exp(w) rotated + t + v, from d residual / d x_in_camera.
template <typename Jacobian>
void pose_jacobian(const Eigen::Matrix<double, 2, 3>& dr_dx, const Eigen::Vector3d& rotated, Jacobian* j) {
  *j << by_turn(dr_dx, rotated), dr_dx, Eigen::Vector2d::Zero();
}

}  // namespace mono_pose_tracker
