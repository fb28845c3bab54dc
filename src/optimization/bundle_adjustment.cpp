#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "pose_parameterization.h"

namespace mono_pose_tracker {

namespace {

// Point and camera to reprojection error; x_in_camera = R x_in_map + t.
class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  explicit ReprojectionCost(const BundleObservation& observation) : o_(observation) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4), x_in_map(parameters[1]);
    const Eigen::Matrix3d rotation = q.toRotationMatrix();
    const Eigen::Vector3d rotated = rotation * x_in_map;
    const Eigen::Vector3d x_in_camera = rotated + t;
    const double along = o_.bearing.dot(x_in_camera);
    if (along <= 1e-9 * x_in_camera.norm()) return false;  // the step went behind the camera: too long
    const double weight = 1.0 / (o_.sigma_px * along);
    Eigen::Map<Eigen::Vector2d> r(residuals);
    r = weight * (o_.pixel_from_bearing * x_in_camera);
    if (!jacobians) return true;
    const Eigen::Matrix<double, 2, 3> dr_dx =
        weight * o_.pixel_from_bearing - (r / along) * o_.bearing.transpose();
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> j(jacobians[0]);
      pose_jacobian(dr_dx, rotated, &j);
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = dr_dx * rotation;
    }
    return true;
  }

 private:
  BundleObservation o_;
};

using PoseBlock = std::array<double, 7>;

PoseBlock to_block(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Rigid3 from_block(const PoseBlock& b) {
  return {Eigen::Quaterniond(b[3], b[0], b[1], b[2]).normalized(), Eigen::Vector3d(b[4], b[5], b[6])};
}

bool is_in_front(const BundleProblem& problem, const BundleObservation& o) {
  const Eigen::Vector3d x_in_camera = problem.cameras[o.camera].camera_from_map * problem.points[o.point];
  return o.bearing.dot(x_in_camera) > 1e-6 * x_in_camera.norm();
}

void add_observations(const BundleOptions& options, BundleProblem* problem, std::vector<PoseBlock>* blocks,
                      ceres::Problem* ceres_problem) {
  ceres::LossFunction* loss = options.loss_width > 0 ? new ceres::CauchyLoss(options.loss_width) : nullptr;
  std::vector<char> camera_used(problem->cameras.size(), 0);
  bool loss_used = false;
  for (const BundleObservation& o : problem->observations) {
    if (!is_in_front(*problem, o)) continue;
    ceres_problem->AddResidualBlock(new ReprojectionCost(o), loss, (*blocks)[o.camera].data(),
                                    problem->points[o.point].data());
    camera_used[o.camera] = 1;
    loss_used = true;
  }
  if (!loss_used) delete loss;
  for (std::size_t i = 0; i < blocks->size(); ++i) {
    if (!camera_used[i]) continue;
    if (problem->cameras[i].constant) {
      ceres_problem->SetParameterBlockConstant((*blocks)[i].data());
    } else {
      set_pose_parameterization((*blocks)[i].data(), ceres_problem);
    }
  }
}

ceres::Solver::Options solver_options(const BundleOptions& options, const BundleProblem& problem) {
  ceres::Solver::Options solver;
  const auto free_cameras = std::count_if(problem.cameras.begin(), problem.cameras.end(),
                                          [](const auto& c) { return !c.constant; });
  // Below some 60 cameras the reduced camera matrix of a window is nearly full.
  solver.linear_solver_type = free_cameras <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.max_num_iterations = options.max_iterations;
  solver.max_solver_time_in_seconds = options.max_seconds;
  solver.function_tolerance = options.function_tolerance;
  solver.num_threads = options.num_threads;
  solver.logging_type = ceres::SILENT;
  return solver;
}

// Restores the scale that a problem without constant cameras leaves free.
void restore_scale(const Eigen::Vector3d& first_center, std::size_t farthest, double distance,
                   BundleProblem* problem) {
  const double now = (problem->cameras[farthest].camera_from_map.inverse().translation - first_center).norm();
  if (!(now > 0) || !(distance > 0)) return;
  const double scale = distance / now;
  for (BundleCamera& camera : problem->cameras) {
    const Eigen::Vector3d center = camera.camera_from_map.inverse().translation;
    const Eigen::Vector3d moved = first_center + scale * (center - first_center);
    camera.camera_from_map.translation = -(camera.camera_from_map.rotation * moved);
  }
  for (Eigen::Vector3d& x : problem->points) x = first_center + scale * (x - first_center);
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
  check(num_threads >= 1, "num_threads", num_threads, ">= 1");
}

BundleReport adjust_bundle(const BundleOptions& options, BundleProblem* problem) {
  BundleReport report;
  if (problem->cameras.empty() || problem->observations.empty()) return report;
  const bool gauge_free = std::none_of(problem->cameras.begin(), problem->cameras.end(),
                                       [](const BundleCamera& c) { return c.constant; });
  const Eigen::Vector3d first_center = problem->cameras[0].camera_from_map.inverse().translation;
  std::size_t farthest = 0;
  double distance = 0;
  if (gauge_free) {
    problem->cameras[0].constant = true;
    for (std::size_t i = 1; i < problem->cameras.size(); ++i) {
      const double d = (problem->cameras[i].camera_from_map.inverse().translation - first_center).norm();
      if (d > distance) distance = d, farthest = i;
    }
  }
  std::vector<PoseBlock> blocks;
  blocks.reserve(problem->cameras.size());
  for (const BundleCamera& camera : problem->cameras) blocks.push_back(to_block(camera.camera_from_map));

  ceres::Problem ceres_problem;
  add_observations(options, problem, &blocks, &ceres_problem);
  if (ceres_problem.NumResidualBlocks() == 0) return report;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(options, *problem), &ceres_problem, &summary);
  report.usable = summary.IsSolutionUsable();
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!problem->cameras[i].constant) problem->cameras[i].camera_from_map = from_block(blocks[i]);
  }
  if (gauge_free) {
    problem->cameras[0].constant = false;
    restore_scale(first_center, farthest, distance, problem);
  }
  return report;
}

}  // namespace mono_pose_tracker
