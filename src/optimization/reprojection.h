#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Reprojection residual in sigmas, and its derivative by the point in the camera's frame.
struct Reprojection {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 3> by_point;
  bool in_front = true;  // else the residual is at its limit, and the derivative 0

  // weighted: pixel_from_bearing / sigma_px. To first order the residual is `weighted` times the tangent of
  // the angle. Beyond the norm of `weighted` (some 55 degrees) and behind the camera it is constant. A point
  // that a step moves behind one camera thus costs its own residual only, and the step is judged by all the
  // others.
  Reprojection(const Eigen::Vector3d& bearing, const Eigen::Matrix<double, 2, 3>& weighted,
               const Eigen::Vector3d& x_in_camera) {
    const double limit = weighted.squaredNorm();
    const double along = bearing.dot(x_in_camera);
    residual = weighted * x_in_camera / along;
    if (!(along > 0) || !(residual.squaredNorm() < limit)) {
      residual << std::sqrt(limit), 0;
      by_point.setZero();
      in_front = false;
      return;
    }
    by_point = (weighted - residual * bearing.transpose()) / along;
  }
};

// Derivative by a rotation of the camera, from that by a translation of the point (both in the camera's
// frame); turned: the point relative to the centre of rotation.
inline Eigen::Matrix<double, 2, 3> by_turn(const Eigen::Matrix<double, 2, 3>& by_point,
                                           const Eigen::Vector3d& turned) {
  Eigen::Matrix<double, 2, 3> result;
  for (int row = 0; row < 2; ++row) {
    result.row(row) = turned.cross(by_point.row(row).transpose()).transpose();
  }
  return result;
}

// Loss rho of a squared residual s in sigmas, Cauchy's or (width 0) s itself, and its derivatives.
class Loss {
 public:
  explicit Loss(double width) : width2_(width * width) {}

  bool is_robust() const { return width2_ > 0; }
  double cost(double s) const { return is_robust() ? width2_ * std::log1p(s / width2_) : s; }
  double derivative(double s) const { return is_robust() ? 1 / (1 + s / width2_) : 1; }
  // Second derivative of rho(|r|^2) / 2 along r over that across r, which is the first derivative of rho. A
  // step needs it positive. Reweighted least squares take 1: for noise of half the squared width that is
  // three times too stiff, and steps are a third of the optimal ones.
  double curvature_ratio(double s, double least) const {
    const double u = is_robust() ? s / width2_ : 0;
    return std::max(least, (1 - u) / (1 + u));
  }

 private:
  double width2_;
};

inline bool is_usable(const BundleObservation& o) {
  return o.sigma_px > 0 && std::isfinite(o.sigma_px) && o.bearing.allFinite() &&
         o.pixel_from_bearing.allFinite();
}

}  // namespace mono_pose_tracker
