#include "positive_definite.h"

#include <Eigen/Dense>

namespace mono_pose_tracker {

std::optional<Eigen::MatrixXd> cholesky_factor(const Eigen::MatrixXd& a) {
  const Eigen::LLT<Eigen::MatrixXd> llt(a);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return Eigen::MatrixXd(llt.matrixL());
}

std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::MatrixXd& a) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(a);
  if (!(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  return Eigen::MatrixXd(ldlt.solve(Eigen::MatrixXd::Identity(a.rows(), a.cols())));
}

}  // namespace mono_pose_tracker
