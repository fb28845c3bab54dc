#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

struct BundleCamera {
  Rigid3 camera_from_map;
  bool constant = false;
};

/// The residual is pixel_from_bearing * x_in_camera / (bearing . x_in_camera) / sigma_px: the reprojection
/// error to first order, the same for every camera model.
struct BundleObservation {
  int camera = -1;
  int point = -1;
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 2, 3> pixel_from_bearing;
  double sigma_px = 1;
};

struct BundleProblem {
  std::vector<BundleCamera> cameras;
  std::vector<Eigen::Vector3d> points;  // in the map's frame
  std::vector<BundleObservation> observations;
};

struct BundleOptions {
  int max_iterations = 20;
  double max_seconds = 1e9;  // wall time; offline it must not bind, or results would not repeat
  double loss_width = 2.0;   // Cauchy loss, in sigmas; 0: squared loss
  double function_tolerance = 1e-6;
  int num_threads = 1;  // Ceres does not repeat its sums on more than one
  int own_threads = 1;  // of what is not Ceres's: the result is the same for any number
  /// For adjust_keyframes: largest estimated number of multiplications per iteration, since a solve can only
  /// be cancelled between iterations; 0: unlimited.
  double max_iteration_work = 0;
  /// Called by the solving thread after every iteration; true ends the solve with the best solution so far.
  std::function<bool()> cancel;
  bool is_cancelled() const { return cancel && cancel(); }

  /// Throws std::invalid_argument naming key, value and range.
  void validate() const;
};

struct BundleReport {
  bool failed = false;  // tried, and thrown away: the problem is as it was
  bool usable = false;  // the solution is no worse than the start; else all is as it was
  double initial_cost = 0;
  double final_cost = 0;
  int iterations = 0;
  bool cancelled = false;
};

/// Bundle adjustment (Triggs et al. 1999): Ceres, Schur complement, analytic derivatives; adjust_points if
/// all cameras are constant. The constant cameras fix the gauge, or else the first camera and one coordinate
/// of the farthest. Observations that are not finite, or start behind their camera, are ignored. An
/// observation that moves behind its camera costs as much as an error of 55 degrees. Writes nothing to the
/// terminal.
BundleReport adjust_bundle(const BundleOptions& options, BundleProblem* problem);

}  // namespace mono_pose_tracker
