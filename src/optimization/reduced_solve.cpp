#include "reduced_solve.h"

#include <algorithm>
#include <cmath>

#include "reduced_bundle.h"
#include "solver_options.h"

namespace mono_pose_tracker {

namespace {

// Largest number of free cameras. The work on the reduced matrix, which is treated as dense, grows with the
// cube; with some 100 cameras it equals the work on their points.
constexpr std::size_t kMaxCameras = 120;

// Offset added to the cost, in initial costs: the predicted reduction of a step must stay below it, which
// with the curvature of the loss may be a few times the cost.
constexpr double kOffset = 2;

// The reduced problem in the form that Ceres takes: residuals with half their square equal to cost and
// offset, and derivatives that give its gradient and curvature. The last residual carries the remainder.
class ReducedCost : public ceres::CostFunction {
 public:
  explicit ReducedCost(ReducedBundle* bundle) : bundle_(*bundle), offset_(kOffset * bundle->initial_cost()) {
    mutable_parameter_block_sizes()->push_back(bundle->parameters());
    set_num_residuals(bundle->parameters() + 1);
  }

  double offset() const { return offset_; }

  // Ceres asks for derivatives at the start and after an accepted step, each time after the cost there.
  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const int size = bundle_.parameters();
    if (!std::equal(at_.begin(), at_.end(), parameters[0], parameters[0] + size)) {
      at_.assign(parameters[0], parameters[0] + size);
      cost_ = bundle_.evaluate(at_.data());
    }
    Eigen::Map<Eigen::VectorXd> r(residuals, size + 1);
    r.setZero();
    if (jacobians && jacobians[0]) {
      Eigen::MatrixXd factor;
      Eigen::VectorXd residual;
      if (!bundle_.linearize(&factor, &residual)) return false;
      using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<Rows> j(jacobians[0], size + 1, size);
      j.topRows(size) = factor.transpose();
      j.row(size).setZero();
      r.head(size) = residual;
    }
    r[size] = std::sqrt(std::max(0.0, 2 * (cost_ + offset_) - r.squaredNorm()));
    return std::isfinite(cost_);
  }

 private:
  ReducedBundle& bundle_;
  const double offset_;
  mutable std::vector<double> at_;
  mutable double cost_ = 0;
};

}  // namespace

bool solve_reduced(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem,
                   CancelCallback* cancel, ceres::Solver::Summary* summary) {
  const std::vector<int>& free = cameras->free;
  if (!(options.loss_width > 0) || free.empty() || free.size() > kMaxCameras) return false;
  ReducedBundle bundle(options.loss_width, *cameras, *problem, options.own_threads);
  if (!bundle.is_near_noise()) return false;
  std::vector<double> parameters;
  for (const int i : free) {
    parameters.insert(parameters.end(), cameras->blocks[i].begin(), cameras->blocks[i].end());
  }
  ReducedCost cost(&bundle);
  ceres::Problem::Options owned;
  owned.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem reduced(owned);
  reduced.AddResidualBlock(&cost, nullptr, parameters.data());
  ceres::Solver::Options solver = solver_options(options, cancel);
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.function_tolerance /= 1 + kOffset;
  ceres::Solve(solver, &reduced, summary);
  summary->initial_cost = bundle.initial_cost();
  summary->final_cost -= cost.offset();
  for (std::size_t i = 0; i < free.size(); ++i) {
    std::copy_n(parameters.begin() + 6 * static_cast<std::ptrdiff_t>(i), 6, cameras->blocks[free[i]].begin());
  }
  problem->points = bundle.points();
  return true;
}

}  // namespace mono_pose_tracker
