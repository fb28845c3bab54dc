#pragma once

#include <Eigen/Dense>
#include <algorithm>

namespace mono_pose_tracker {

/// A quadratic model of the cost about where it was made: half the Hessian's approximation J'J, and J'r.
template <int N>
struct NormalEquations {
  Eigen::Matrix<double, N, N> information = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> gradient = Eigen::Matrix<double, N, 1>::Zero();
};

struct LevenbergMarquardtOptions {
  int max_iterations = 10;       // linearisations
  double least_damping = 1e-9;   // relative to the diagonal
  double floor = 0;              // added to the diagonal: keeps unconstrained directions solvable
  double first_damping = 1e-4;   // relative to the diagonal
  double most_damping = 1e6;     // a step of a millionth of the diagonal's: nothing lowers the cost
  double least_decrease = 1e-6;  // relative: less than the sixth digit of the cost moves the model far below
                                 // its uncertainty
};

/// Minimises the cost of a few parameters (Marquardt 1963: the diagonal is scaled), which never grows. The
/// problem has linearize(model), to normal equations; stepped(model, step); and cost(model), which may be
/// truncated or otherwise robust as long as the equations' gradient is its own. Returns the cost reached.
template <typename Problem, typename Model>
double levenberg_marquardt(const Problem& problem, const LevenbergMarquardtOptions& options, Model* model) {
  double cost = problem.cost(*model);
  double damping = options.first_damping;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const auto equations = problem.linearize(*model);
    const double previous = cost;
    while (damping < options.most_damping) {
      auto damped = equations.information;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += options.floor;
      const Model candidate = problem.stepped(*model, -damped.ldlt().solve(equations.gradient));
      const double candidate_cost = problem.cost(candidate);
      if (candidate_cost < cost) {
        *model = candidate;
        cost = candidate_cost;
        damping = std::max(options.least_damping, damping * 0.1);
        break;
      }
      damping *= 10;
    }
    if (!(previous - cost > options.least_decrease * cost)) break;
  }
  return cost;
}

}  // namespace mono_pose_tracker
