#pragma once

#include <ceres/ceres.h>

#include "cancel_callback.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Beyond this radius damping adds less than 1e-8 to a diagonal. That is enough for a Cholesky decomposition
// with unconstrained directions, which Ceres would otherwise report on the terminal, and does not slow
// convergence.
constexpr double kMaxTrustRegionRadius = 1e8;

// Solver options shared by all bundle problems.
inline ceres::Solver::Options solver_options(const BundleOptions& options, CancelCallback* cancel) {
  ceres::Solver::Options solver;
  solver.max_num_iterations = options.max_iterations;
  solver.max_solver_time_in_seconds = options.max_seconds;
  solver.max_trust_region_radius = kMaxTrustRegionRadius;
  solver.function_tolerance = options.function_tolerance;
  solver.num_threads = options.num_threads;
  solver.logging_type = ceres::SILENT;
  if (options.cancel) solver.callbacks.push_back(cancel);
  return solver;
}

}  // namespace mono_pose_tracker
