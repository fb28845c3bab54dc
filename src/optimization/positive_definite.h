#pragma once

#include <Eigen/Core>
#include <optional>

namespace mono_pose_tracker {

/// For symmetric matrices of any size; nothing where one is not positive definite. Kept from the code that
/// asks: Eigen's products of matrices of any size take seconds to compile wherever they are seen.

/// L of A = L L^T, lower triangular.
std::optional<Eigen::MatrixXd> cholesky_factor(const Eigen::MatrixXd& a);

std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::MatrixXd& a);

}  // namespace mono_pose_tracker
