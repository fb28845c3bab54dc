#include "reduced_system.h"

#include <Eigen/Dense>
#include <algorithm>

namespace mono_pose_tracker {

std::optional<Eigen::VectorXd> solve_positive(Eigen::MatrixXd a, const Eigen::VectorXd& b) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(a);
  if (llt.info() != Eigen::Success) return std::nullopt;
  Eigen::VectorXd x = llt.solve(b);
  if (!x.allFinite()) return std::nullopt;
  return x;
}

std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::MatrixXd& a) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(a);
  if (!(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  return Eigen::MatrixXd(ldlt.solve(Eigen::MatrixXd::Identity(a.rows(), a.cols())));
}

ReducedSystem::ReducedSystem(int poses, int shared, double loss_width)
    : poses_(poses), shared_(shared), squared_width_(loss_width * loss_width) {
  information_ = Eigen::MatrixXd::Zero(size(), size());
  shared_point_ = Eigen::MatrixXd::Zero(shared_, 3);
}

void ReducedSystem::add(int pose, const Eigen::Matrix<double, 2, 6>& by_pose,
                        const Eigen::Matrix<double, 2, 3>& by_point,
                        const Eigen::Matrix<double, 2, Eigen::Dynamic>& by_shared,
                        const Eigen::Vector2d& residual) {
  const double s = residual.squaredNorm(), w = squared_width_ > 0 ? 1 / (1 + s / squared_width_) : 1;
  influence_ += w * w * s;
  derivative_ += w * w;
  ++observations_;
  ++num_observations_;
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

void ReducedSystem::eliminate_point() {
  // A point is undetermined along a ray without crossing rays, and then has no information on the poses
  // either. A small share of the trace ensures that, instead of rounding.
  point_point_.diagonal().array() += 1e-14 * point_point_.trace();
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
  }
  point_coordinates_ += std::min(3, 2 * num_observations_);
  num_observations_ = 0;
  point_point_.setZero();
  shared_point_.setZero();
  pose_point_.clear();
}

Eigen::MatrixXd ReducedSystem::shared_information() const {
  const int n = 6 * poses_;
  Eigen::MatrixXd pose_pose = information_.topLeftCorner(n, n);
  const Eigen::MatrixXd pose_shared = information_.topRightCorner(n, shared_);
  for (int i = 0; i < n; ++i) pose_pose(i, i) = pose_pose(i, i) * (1 + 1e-10) + 1e-12;
  const Eigen::MatrixXd marginal = information_.bottomRightCorner(shared_, shared_) -
                                   pose_shared.transpose() * pose_pose.ldlt().solve(pose_shared);
  return 0.5 * (marginal + marginal.transpose());
}

double ReducedSystem::variance() const {
  const double freedom = 2.0 * observations_ - point_coordinates_ - size();
  if (freedom <= 0 || derivative_ <= 0) return 0;
  const double mean_derivative = derivative_ / observations_;
  // Residuals of nothing (exact data) still leave rounding errors.
  return std::max(influence_ / freedom / (mean_derivative * mean_derivative), 1e-12);
}

}  // namespace mono_pose_tracker
