#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// The normal equations of a bundle problem with its points eliminated (Schur complement): what is known of
/// poses, and of parameters that all observations share, once the points are whatever fits best. The noise is
/// taken from the residuals as for an M-estimator with Cauchy's loss (Huber 1981, section 7.6).
class ReducedSystem {
 public:
  /// poses: those that are unknown; shared: parameters. loss_width in sigmas.
  ReducedSystem(int poses, int shared, double loss_width)
      : poses_(poses), shared_(shared), squared_width_(loss_width * loss_width) {
    information_ = Eigen::MatrixXd::Zero(size(), size());
    shared_point_ = Eigen::MatrixXd::Zero(shared_, 3);
  }

  int size() const { return 6 * poses_ + shared_; }

  /// An observation of the present point. pose: -1 where it is held. Derivatives and residual in sigmas.
  void add(int pose, const Eigen::Matrix<double, 2, 6>& by_pose, const Eigen::Matrix<double, 2, 3>& by_point,
           const Eigen::Matrix<double, 2, Eigen::Dynamic>& by_shared, const Eigen::Vector2d& residual) {
    const double s = residual.squaredNorm(), w = 1 / (1 + s / squared_width_);
    influence_ += w * w * s;
    slope_ += w * w;
    ++observations_;
    point_point_ += by_point.transpose() * by_point;
    if (shared_ > 0) {
      const int at = 6 * poses_;
      information_.block(at, at, shared_, shared_) += by_shared.transpose() * by_shared;
      shared_point_ += by_shared.transpose() * by_point;
    }
    if (pose < 0) return;
    const int at = 6 * pose;
    information_.block<6, 6>(at, at) += by_pose.transpose() * by_pose;
    pose_point_.emplace_back(at, by_pose.transpose() * by_point);
    if (shared_ == 0) return;
    information_.block(at, 6 * poses_, 6, shared_) += by_pose.transpose() * by_shared;
    information_.block(6 * poses_, at, shared_, 6) += by_shared.transpose() * by_pose;
  }

  /// All observations of the present point have been added.
  void eliminate_point() {
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(point_point_);
    if (ldlt.vectorD().minCoeff() > 0) {
      const int at = 6 * poses_;
      for (const auto& [a, by_a] : pose_point_) {
        const Eigen::Matrix<double, 3, 6> solved = ldlt.solve(by_a.transpose());
        for (const auto& [b, by_b] : pose_point_) information_.block<6, 6>(b, a) -= by_b * solved;
        if (shared_ == 0) continue;
        const Eigen::MatrixXd mixed = shared_point_ * solved;
        information_.block(at, a, shared_, 6) -= mixed;
        information_.block(a, at, 6, shared_) -= mixed.transpose();
      }
      if (shared_ > 0) {
        information_.block(at, at, shared_, shared_) -= shared_point_ * ldlt.solve(shared_point_.transpose());
      }
      ++points_;
    }
    point_point_.setZero();
    shared_point_.setZero();
    pose_point_.clear();
  }

  /// Poses six rows each (rotation, then translation), then the shared parameters; in units of the variance.
  const Eigen::MatrixXd& information() const { return information_; }

  /// Of a residual; nothing (0) where there is not more to fit than to be fitted.
  double variance() const {
    const double freedom = 2.0 * observations_ - 3.0 * points_ - size();
    if (freedom <= 0 || slope_ <= 0) return 0;
    const double mean_slope = slope_ / observations_;
    // Residuals of nothing (exact data) still leave rounding errors.
    return std::max(influence_ / freedom / (mean_slope * mean_slope), 1e-12);
  }

 private:
  const int poses_, shared_;
  const double squared_width_;
  Eigen::MatrixXd information_;
  double influence_ = 0, slope_ = 0;
  int observations_ = 0, points_ = 0;
  // Of the present point
  Eigen::Matrix3d point_point_ = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd shared_point_;
  std::vector<std::pair<int, Eigen::Matrix<double, 6, 3>>> pose_point_;
};

}  // namespace mono_pose_tracker
