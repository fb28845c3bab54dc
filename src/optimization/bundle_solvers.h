#pragma once

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
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

// Pose block: a rotation w of the camera about its centre and its translation, relative to the initial pose
// and along the initial axes. The parameters are their own tangent space: all blocks have six parameters, for
// which Ceres has compiled code, and no derivative is multiplied by another. With a rotation about the map's
// origin, a distant camera would be translated much more than rotated, and damping would suppress its
// rotation.
using PoseBlock = std::array<double, 6>;

// Quantities shared by all observations of a camera at the evaluated parameters.
struct CameraState {
  Eigen::Matrix3d start_rotation;  // camera_from_map, as it began
  Eigen::Vector3d start_translation;
  Eigen::Matrix3d rotation;  // camera_from_map; exp(w) start_rotation
  Eigen::Vector3d translation;
  Eigen::Vector3d moved;          // v, of translation = exp(w) start_translation + v
  Eigen::Matrix3d left_jacobian;  // of exp at w
  // Index of the constant parameter of the block, or -1. Its derivatives are set to zero, so that Ceres does
  // not move it, and all blocks keep the same size.
  int held = -1;

  void update(const double* block) {
    const Eigen::Vector3d w(block[0], block[1], block[2]);
    moved << block[3], block[4], block[5];
    const double a2 = w.squaredNorm(), a = std::sqrt(a2);
    // sin(a) / a, (1 - cos(a)) / a^2, (a - sin(a)) / a^3; below 1e-3 their series end beyond rounding.
    double s = 1 - a2 / 6, c = 0.5 - a2 / 24, d = 1.0 / 6 - a2 / 120;
    if (a > 1e-3) s = std::sin(a) / a, c = (1 - std::cos(a)) / a2, d = (1 - s) / a2;
    const Eigen::Matrix3d cross = cross_matrix(w), cross2 = cross * cross;
    const Eigen::Matrix3d turn = Eigen::Matrix3d::Identity() + s * cross + c * cross2;
    rotation = turn * start_rotation;
    translation = turn * start_translation + moved;
    left_jacobian = Eigen::Matrix3d::Identity() + c * cross + d * cross2;
  }
};

// The cameras of a problem as parameter blocks, and the fixed gauge.
struct BundleCameras {
  // All observations of the problem are used.
  explicit BundleCameras(const BundleProblem& problem);

  std::vector<PoseBlock> blocks;
  std::vector<CameraState> states;  // at the blocks' start
  std::vector<char> used;           // they see anything
  std::vector<int> free;            // of these, those that may move

  // Pose of a camera for the present blocks.
  Rigid3 pose(std::size_t camera) const;
};

// Solves for cameras and points together, with Ceres' Schur complement. The result is written to the cameras'
// blocks and the problem's points. All observations are used; there must be at least one.
BundleReport solve_in_full(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem);

/// Newton steps of a single point with fixed cameras.
struct PointStepOptions {
  // Smallest curvature ratio of the loss along a residual, for noise, in (0, 1]. The true ratio is negative
  // beyond one loss width, and a step needs it positive. Reweighted least squares (ratio 1) are up to three
  // times too stiff.
  double min_curvature_ratio = 0.3;
  // The first steps use reweighted least squares, which is exact for a displaced point. Later steps use the
  // curvature of the loss: the remaining errors are noise, for which reweighted steps are too short by a
  // third.
  int reweighted_steps = 2;
  // Ends the search: a step would lower the cost by less than this share of the squared loss width (two
  // sigmas squared, by default). It would move the point by 1 % of its standard deviation.
  double tolerance = 1e-5;
};

/// Optimises the points with all cameras fixed, whatever their flags. Each point is solved by itself (damped
/// Newton, at most max_iterations steps), so that a bad one delays no other. Residuals and loss are those of
/// adjust_bundle. A point with fewer than two observations in front of their cameras stays, as does one
/// without improvement. usable: at least one point had two observations; iterations: the largest number of
/// steps of a point. max_seconds and num_threads are ignored: a point takes microseconds.
BundleReport adjust_points(const BundleOptions& options, BundleProblem* problem,
                           const PointStepOptions& steps = {});

}  // namespace mono_pose_tracker
