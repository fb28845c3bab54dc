#include "positive_definite.h"

#include <Eigen/Dense>

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

}  // namespace mono_pose_tracker
