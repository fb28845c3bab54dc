#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "bundle_solvers.h"
#include "ceres_solver.h"
#include "reduced_bundle.h"

namespace mono_pose_tracker {

namespace {

bool is_in_front(const BundleProblem& problem, const BundleObservation& o) {
  const Eigen::Vector3d x_in_camera = problem.cameras[o.camera].camera_from_map * problem.points[o.point];
  return o.bearing.dot(x_in_camera) > 1e-6 * x_in_camera.norm();
}

bool is_finite(const BundleProblem& problem) {
  return std::all_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const BundleCamera& c) {
                       return c.camera_from_map.rotation.coeffs().allFinite() &&
                              c.camera_from_map.translation.allFinite();
                     }) &&
         std::all_of(problem.points.begin(), problem.points.end(),
                     [](const Eigen::Vector3d& x) { return x.allFinite(); });
}

// The problem with the usable observations only.
BundleProblem usable_part(const BundleProblem& problem) {
  BundleProblem part{problem.cameras, problem.points, {}};
  part.observations.reserve(problem.observations.size());
  for (const BundleObservation& o : problem.observations) {
    if (is_usable(o) && is_in_front(problem, o)) part.observations.push_back(o);
  }
  return part;
}

}  // namespace

void BundleOptions::validate() const {
  const auto check = [](bool ok, const char* key, double value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string(key) + " = " + std::to_string(value) + ", expected " + range);
  };
  check(max_iterations >= 1, "max_iterations", max_iterations, ">= 1");
  check(max_seconds > 0, "max_seconds", max_seconds, "> 0");
  check(loss_width >= 0, "loss_width", loss_width, ">= 0");
  check(function_tolerance >= 0, "function_tolerance", function_tolerance, ">= 0");
  check(num_threads >= 1, "num_threads", num_threads, ">= 1");
}

BundleReport adjust_bundle(const BundleOptions& options, BundleProblem* problem) {
  options.validate();
  if (std::all_of(problem->cameras.begin(), problem->cameras.end(),
                  [](const BundleCamera& c) { return c.constant; })) {
    return adjust_points(options, problem);
  }
  BundleProblem adjusted = usable_part(*problem);
  if (adjusted.observations.empty()) return {};
  silence_solver_log();
  BundleCameras cameras(adjusted);
  const std::optional<BundleReport> reduced = solve_reduced(options, &cameras, &adjusted);
  BundleReport report = reduced ? *reduced : solve_in_full(options, &cameras, &adjusted);
  for (const int i : cameras.free) adjusted.cameras[i].camera_from_map = cameras.pose(i);
  report.usable = report.usable && report.final_cost <= report.initial_cost && is_finite(adjusted);
  report.failed = !report.usable;
  if (report.failed) return report;
  problem->cameras = std::move(adjusted.cameras);
  problem->points = std::move(adjusted.points);
  return report;
}

}  // namespace mono_pose_tracker
