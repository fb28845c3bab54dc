#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// The normal equations of a bundle problem with its points eliminated (Schur complement): what is known of
/// poses, and of parameters that all observations share, once the points are whatever fits best. The noise is
/// taken from the residuals as for an M-estimator with Cauchy's loss (Huber 1981, section 7.6).
class ReducedSystem {
 public:
  /// poses: those that are unknown; shared: parameters. loss_width in sigmas; 0: squared loss.
  ReducedSystem(int poses, int shared, double loss_width);

  int size() const { return 6 * poses_ + shared_; }

  /// An observation of the present point. pose: -1 where it is held. Derivatives and residual in sigmas.
  void add(int pose, const Eigen::Matrix<double, 2, 6>& by_pose, const Eigen::Matrix<double, 2, 3>& by_point,
           const Eigen::Matrix<double, 2, Eigen::Dynamic>& by_shared, const Eigen::Vector2d& residual);

  /// All observations of the present point have been added.
  void eliminate_point();

  /// Poses six rows each (rotation, then translation), then the shared parameters; in units of the variance.
  const Eigen::MatrixXd& information() const { return information_; }

  /// Of the shared parameters, once the poses are whatever fits best too. The scale is free: a little of the
  /// diagonal holds it, and no more than it.
  Eigen::MatrixXd shared_information() const;

  /// Of a residual; nothing (0) where there is not more to fit than to be fitted.
  double variance() const;

 private:
  const int poses_, shared_;
  const double squared_width_;
  Eigen::MatrixXd information_;
  double influence_ = 0, derivative_ = 0;
  int observations_ = 0, point_coordinates_ = 0;
  // Of the present point
  int num_observations_ = 0;
  Eigen::Matrix3d point_point_ = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd shared_point_;
  std::vector<std::pair<int, Eigen::Matrix<double, 6, 3>>> pose_point_;
};

}  // namespace mono_pose_tracker
