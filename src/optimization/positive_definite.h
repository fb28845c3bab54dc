#pragma once

#include <Eigen/Core>
#include <optional>

namespace mono_pose_tracker {

/// Decompositions of symmetric matrices of any size; nothing if not positive definite. In a file of its own
/// because Eigen's products of dynamic matrices take seconds to compile in each file that uses them.

/// x of A x = b; only the lower triangle of A is read.
std::optional<Eigen::VectorXd> solve_positive(Eigen::MatrixXd a, const Eigen::VectorXd& b);

std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::MatrixXd& a);

}  // namespace mono_pose_tracker
