#pragma once

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <functional>
#include <mutex>

#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Ends a solve when the owner of the options requests it.
class CancelCallback : public ceres::IterationCallback {
 public:
  explicit CancelCallback(const std::function<bool()>& cancel) : cancel_(cancel) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    cancelled_ = cancel_();
    return cancelled_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool cancelled() const { return cancelled_; }

 private:
  const std::function<bool()>& cancel_;
  bool cancelled_ = false;
};

// Ceres warns through glog about every step that it takes back, on standard error unless the program has set
// up glog; SILENT does not affect these lines. Failed solves are visible in the report. This raises glog's
// level to errors, once per process and only if the process has not chosen a level itself.
inline void silence_solver_log() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (FLAGS_minloglevel == google::GLOG_INFO) FLAGS_minloglevel = google::GLOG_ERROR;
  });
}

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
