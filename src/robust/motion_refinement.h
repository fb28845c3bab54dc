#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

struct MotionRefinementOptions {
  int max_iterations = 10;
  double loss_width = 2.0;     // Cauchy loss, in units of each match's sigma: little is lost on clean matches
  double newton_below = 0.05;  // share by which a step lowers the cost, below which the cost is taken for a
                               // parabola
};

struct MotionRefinementReport {
  bool converged = false;
  Rigid3 camera_from_map;
  double final_cost = 0;
  /// Of a left perturbation of camera_from_map, x_in_camera' = exp(w) x_in_camera + v: order v (map units), w
  /// (rad). Inverse of the information matrix, scaled by the residuals' variance factor. Zero only when not
  /// converged.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Robust motion-only refinement: the pose with the least (robust) sum of squared angular errors, points held
/// fixed. sigmas: the expected error of each bearing in radians (empty: all equal).
MotionRefinementReport refine_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                            const std::vector<Eigen::Vector3d>& points_in_map,
                                            const std::vector<double>& sigmas,
                                            const Rigid3& initial_camera_from_map,
                                            const MotionRefinementOptions& options);

}  // namespace mono_pose_tracker
