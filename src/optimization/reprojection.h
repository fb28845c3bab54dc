#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// A residual of reprojection in sigmas, and its derivative by the point in the camera's frame.
struct Reprojection {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 3> by_point;
  bool in_front = true;  // else the residual is the greatest there is, and the derivative 0

  // weighted: pixel_from_bearing / sigma_px. To first order the residual is what a radian weighs times the
  // tangent of the angle; where that exceeds the norm of `weighted` (some 55 degrees), and behind the camera,
  // it stays what it is there. So a point that a step takes behind one camera costs its own residual, and the
  // step is judged by all others.
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

// What a turn of the camera moves, from what a movement of the point (both in the camera's frame) does;
// turned: the point, from what it is turned about.
inline Eigen::Matrix<double, 2, 3> by_turn(const Eigen::Matrix<double, 2, 3>& by_point,
                                           const Eigen::Vector3d& turned) {
  Eigen::Matrix<double, 2, 3> result;
  for (int row = 0; row < 2; ++row) {
    result.row(row) = turned.cross(by_point.row(row).transpose()).transpose();
  }
  return result;
}

// Of a square s of sigmas: the cost rho(s), Cauchy's or (width 0) s itself, and how it bends.
class Loss {
 public:
  explicit Loss(double width) : width2_(width * width) {}

  bool is_robust() const { return width2_ > 0; }
  double cost(double s) const { return is_robust() ? width2_ * std::log1p(s / width2_) : s; }
  double derivative(double s) const { return is_robust() ? 1 / (1 + s / width2_) : 1; }
  // Second derivative of rho(|r|^2) / 2 along r, over the one across r, which is the slope; a step needs it
  // above 0. Reweighted least squares take it for 1: where the residual is noise of half the width squared,
  // that is three times too stiff, and steps become a third of what they should be.
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
