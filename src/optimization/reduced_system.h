#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// Decompositions of symmetric matrices of any size; nothing if not positive definite. In a file of its own
/// because Eigen's products of dynamic matrices take seconds to compile in each file that uses them.

/// x of A x = b; only the lower triangle of A is read.
std::optional<Eigen::VectorXd> solve_positive(Eigen::MatrixXd a, const Eigen::VectorXd& b);

std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::MatrixXd& a);

/// Normal equations of a bundle problem with its points eliminated (Schur complement): the information on
/// poses and on parameters shared by all observations. The noise is estimated from the residuals as for an
/// M-estimator with Cauchy's loss (Huber 1981, section 7.6).
class ReducedSystem {
 public:
  /// poses, shared: numbers of unknown poses and of shared parameters. loss_width in sigmas; 0: squared loss.
  ReducedSystem(int poses, int shared, double loss_width);

  int size() const { return 6 * poses_ + shared_; }

  /// Adds an observation of the present point. pose: -1 if it is constant. Derivatives and residual in
  /// sigmas.
  void add(int pose, const Eigen::Matrix<double, 2, 6>& by_pose, const Eigen::Matrix<double, 2, 3>& by_point,
           const Eigen::Matrix<double, 2, Eigen::Dynamic>& by_shared, const Eigen::Vector2d& residual);

  /// Ends the present point: all its observations have been added.
  void eliminate_point();

  /// Six rows per pose (rotation, then translation), then the shared parameters; for noise of variance 1.
  const Eigen::MatrixXd& information() const { return information_; }

  /// Information on the shared parameters, with the poses eliminated. The scale is free; a small share of the
  /// diagonal fixes it and nothing else.
  Eigen::MatrixXd shared_information() const;

  /// Variance of a residual; 0 unless there are more residuals than unknowns.
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
