#include "reduced_solve.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "positive_definite.h"
#include "reduced_bundle.h"
#include "solver_options.h"

namespace mono_pose_tracker {

namespace {

// Largest number of free cameras. The work on the reduced matrix, which is treated as dense, grows with the
// cube: with 400 cameras it is 5e9 multiplications an iteration.
constexpr std::size_t kMaxCameras = 400;

using Clock = std::chrono::steady_clock;

// Trust region of Levenberg-Marquardt steps, as in Ceres: the damping is the diagonal over the radius
// (Marquardt 1963), which follows the ratio of the reduction of the cost to the predicted one (Nielsen 1999).
class TrustRegion {
 public:
  double radius() const { return radius_; }
  bool is_empty() const { return radius_ < kMinRadius; }
  // Returns whether the step is accepted.
  bool judge(double ratio) {
    if (!(ratio > kMinRatio)) {
      radius_ /= shrinkage_;
      shrinkage_ *= 2;
      return false;
    }
    radius_ = std::min(kMaxTrustRegionRadius, radius_ / std::max(1.0 / 3, 1 - std::pow(2 * ratio - 1, 3)));
    shrinkage_ = 2;
    return true;
  }

 private:
  static constexpr double kMinRatio = 1e-3, kMinRadius = 1e-32;
  double radius_ = 1e4, shrinkage_ = 2;
};

// The step that minimises the damped quadratic model, and the reduction of the cost that the model promises
// for it; 0: the damped matrix is not positive definite.
class Step {
 public:
  Step(const Eigen::MatrixXd& information, const Eigen::VectorXd& gradient, double radius) {
    const Eigen::VectorXd damping = information.diagonal() / radius;
    Eigen::MatrixXd damped = information;
    damped.diagonal() += damping;
    const std::optional<Eigen::VectorXd> step = solve_positive(std::move(damped), -gradient);
    if (!step) return;
    by_ = *step;
    promised_ = 0.5 * (by_.dot(damping.cwiseProduct(by_)) - gradient.dot(by_));
  }

  const Eigen::VectorXd& by() const { return by_; }
  double promised() const { return promised_; }

 private:
  Eigen::VectorXd by_;
  double promised_ = 0;
};

BundleReport minimize(const BundleOptions& options, ReducedBundle* bundle, Eigen::VectorXd* parameters) {
  constexpr double kNoStep = 1e-8;  // relative to the parameters
  const auto begin = Clock::now();
  BundleReport report;
  report.initial_cost = bundle->initial_cost();
  report.final_cost = bundle->evaluate(parameters->data());
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  bundle->linearize(&information, &gradient);
  TrustRegion region;
  for (; report.iterations < options.max_iterations && !region.is_empty(); ++report.iterations) {
    report.cancelled = options.is_cancelled();
    if (report.cancelled || std::chrono::duration<double>(Clock::now() - begin).count() > options.max_seconds)
      break;
    const Step step(information, gradient, region.radius());
    if (!(step.promised() > 0)) {
      region.judge(0);
      continue;
    }
    if (step.by().norm() <= kNoStep * (parameters->norm() + kNoStep)) break;
    const Eigen::VectorXd candidate = *parameters + step.by();
    const double cost = bundle->evaluate(candidate.data()), reduction = report.final_cost - cost;
    if (std::abs(reduction) <= options.function_tolerance * report.final_cost) break;
    if (!region.judge(reduction / step.promised())) continue;
    *parameters = candidate;
    report.final_cost = cost;
    bundle->linearize(&information, &gradient);
  }
  report.usable = std::isfinite(report.final_cost) && parameters->allFinite();
  return report;
}

}  // namespace

std::optional<BundleReport> solve_reduced(const BundleOptions& options, BundleCameras* cameras,
                                          BundleProblem* problem) {
  const std::vector<int>& free = cameras->free;
  if (!(options.loss_width > 0) || free.empty() || free.size() > kMaxCameras) return std::nullopt;
  ReducedBundle bundle(options.loss_width, *cameras, *problem, options.own_threads);
  if (!bundle.is_near_noise()) return std::nullopt;
  Eigen::VectorXd parameters(bundle.parameters());
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    parameters.segment<6>(at) =
        Eigen::Map<const Eigen::Matrix<double, 6, 1>>(cameras->blocks[free[i]].data());
  }
  const BundleReport report = minimize(options, &bundle, &parameters);
  for (std::size_t i = 0; i < free.size(); ++i)
    std::copy_n(parameters.data() + 6 * i, 6, cameras->blocks[free[i]].begin());
  problem->points = bundle.points();
  return report;
}

}  // namespace mono_pose_tracker
