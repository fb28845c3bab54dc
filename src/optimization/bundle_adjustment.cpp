#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "cancel_callback.h"
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

// What holds a problem without constant cameras: its first camera, and of the camera farthest from it the
// coordinate of the translation that a change of scale would move most.
struct Gauge {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t fixed_camera = kNone;
  std::size_t scale_camera = kNone;
  int scale_coordinate = -1;  // in (w, v)
};

Gauge choose_gauge(const std::vector<BundleCamera>& cameras) {
  Gauge gauge;
  if (std::any_of(cameras.begin(), cameras.end(), [](const BundleCamera& c) { return c.constant; }))
    return gauge;
  gauge.fixed_camera = 0;
  const Eigen::Vector3d first_center = cameras[0].camera_from_map.inverse().translation;
  double farthest = 0;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    // Scaling about the first centre moves the translation along this.
    const Eigen::Vector3d moved = cameras[i].camera_from_map * first_center;
    if (moved.norm() <= farthest) continue;
    farthest = moved.norm();
    gauge.scale_camera = i;
    moved.cwiseAbs().maxCoeff(&gauge.scale_coordinate);
    gauge.scale_coordinate += 3;
  }
  return gauge;
}

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

void add_observations(const BundleOptions& options, const Gauge& gauge, BundleProblem* problem,
                      std::vector<PoseBlock>* blocks, ceres::Problem* ceres_problem) {
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
    if (problem->cameras[i].constant || i == gauge.fixed_camera) {
      ceres_problem->SetParameterBlockConstant((*blocks)[i].data());
    } else {
      const int held = i == gauge.scale_camera ? gauge.scale_coordinate : -1;
      set_pose_parameterization((*blocks)[i].data(), held, ceres_problem);
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
  std::vector<PoseBlock> blocks;
  blocks.reserve(problem->cameras.size());
  for (const BundleCamera& camera : problem->cameras) blocks.push_back(to_block(camera.camera_from_map));

  ceres::Problem ceres_problem;
  add_observations(options, choose_gauge(problem->cameras), problem, &blocks, &ceres_problem);
  if (ceres_problem.NumResidualBlocks() == 0) return report;
  ceres::Solver::Summary summary;
  ceres::Solver::Options solver = solver_options(options, *problem);
  CancelCallback cancel(options.cancel);
  if (options.cancel) solver.callbacks.push_back(&cancel);
  ceres::Solve(solver, &ceres_problem, &summary);
  report.usable = summary.IsSolutionUsable();
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  report.cancelled = cancel.cancelled();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!problem->cameras[i].constant) problem->cameras[i].camera_from_map = from_block(blocks[i]);
  }
  return report;
}

}  // namespace mono_pose_tracker
