#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <ceres/version.h>

#include <Eigen/Dense>
#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "bundle_solvers.h"
#include "ceres_solver.h"
#include "reduced_bundle.h"

namespace mono_pose_tracker {
namespace {

// Fixes the scale: of the camera farthest from the first one, the translation coordinate that a change of
// scale about the first camera changes most. With free scale, Ceres' steps diverge along the weakly
// determined directions of a narrow view (depth against rotation): heads recorded with a long lens end with
// reversed depth.
void hold_scale(const BundleProblem& problem, BundleCameras* cameras) {
  const Eigen::Vector3d first = problem.cameras[0].camera_from_map.inverse().translation;
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  int camera = 0;
  for (std::size_t i = 1; i < problem.cameras.size(); ++i) {
    const Eigen::Vector3d moved = problem.cameras[i].camera_from_map * first;
    if (moved.norm() > farthest.norm()) farthest = moved, camera = static_cast<int>(i);
  }
  int coordinate = 0;
  farthest.cwiseAbs().maxCoeff(&coordinate);
  if (std::binary_search(cameras->free.begin(), cameras->free.end(), camera))
    cameras->states[camera].held = 3 + coordinate;
}

}  // namespace

BundleCameras::BundleCameras(const BundleProblem& problem)
    : blocks(problem.cameras.size()), states(problem.cameras.size()), used(problem.cameras.size(), 0) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Rigid3& pose = problem.cameras[i].camera_from_map;
    blocks[i] = {};
    states[i].start_rotation = pose.rotation_matrix();
    states[i].start_translation = pose.translation;
    states[i].update(blocks[i].data());
  }
  for (const BundleObservation& o : problem.observations) used[o.camera] = 1;
  const bool held_by_others = std::any_of(problem.cameras.begin(), problem.cameras.end(),
                                          [](const BundleCamera& c) { return c.constant; });
  for (std::size_t i = held_by_others ? 0 : 1; i < blocks.size(); ++i) {
    if (used[i] && !problem.cameras[i].constant) free.push_back(static_cast<int>(i));
  }
  if (!held_by_others) hold_scale(problem, this);
}

Rigid3 BundleCameras::pose(std::size_t camera) const {
  CameraState state = states[camera];
  state.update(blocks[camera].data());
  return {Eigen::Quaterniond(state.rotation).normalized(), state.translation};
}

namespace {

// Ceres calls this before each evaluation at new parameters.
class CameraUpdate : public ceres::EvaluationCallback {
 public:
  CameraUpdate(const std::vector<PoseBlock>& blocks, std::vector<CameraState>* states)
      : blocks_(blocks), states_(*states) {}

  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (!new_evaluation_point) return;
    for (std::size_t i = 0; i < blocks_.size(); ++i) states_[i].update(blocks_[i].data());
  }

 private:
  const std::vector<PoseBlock>& blocks_;
  std::vector<CameraState>& states_;
};

// Point and camera to reprojection error in sigmas; x_in_camera = R x_in_map + t.
class ReprojectionCost : public ceres::SizedCostFunction<2, 6, 3> {
 public:
  ReprojectionCost(const BundleObservation& o, const CameraState& camera)
      : bearing_(o.bearing), weighted_(o.pixel_from_bearing / o.sigma_px), camera_(camera) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> x_in_map(parameters[1]);
    const Eigen::Vector3d x_in_camera = camera_.rotation * x_in_map + camera_.translation;
    const Reprojection p(bearing_, weighted_, x_in_camera);
    Eigen::Map<Eigen::Vector2d> r(residuals);
    r = p.residual;
    if (!jacobians) return true;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> j(jacobians[0]);
      j.leftCols<3>() = by_turn(p.by_point, x_in_camera - camera_.moved) * camera_.left_jacobian;
      j.rightCols<3>() = p.by_point;
      if (camera_.held >= 0) j.col(camera_.held).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = p.by_point * camera_.rotation;
    }
    return true;
  }

 private:
  const Eigen::Vector3d bearing_;
  const Eigen::Matrix<double, 2, 3> weighted_;
  const CameraState& camera_;
};

ceres::Problem::Options problem_options(ceres::EvaluationCallback* update) {
  ceres::Problem::Options options;
#if CERES_VERSION_MAJOR >= 2
  options.evaluation_callback = update;
#else
  static_cast<void>(update);  // given to the solver
#endif
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;  // the blocks are ours, and apart
  return options;
}

}  // namespace

BundleReport solve_in_full(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem) {
  CameraUpdate update(cameras->blocks, &cameras->states);
  std::unique_ptr<ceres::LossFunction> loss;
  if (options.loss_width > 0) loss = std::make_unique<ceres::CauchyLoss>(options.loss_width);
  ceres::Problem full(problem_options(&update));
  std::vector<char> point_used(problem->points.size(), 0);
  for (const BundleObservation& o : problem->observations) {
    full.AddResidualBlock(new ReprojectionCost(o, cameras->states[o.camera]), loss.get(),
                          cameras->blocks[o.camera].data(), problem->points[o.point].data());
    point_used[o.point] = 1;
  }
  // Given, so that Ceres does not look for it in a graph of all residuals.
  auto ordering = std::make_unique<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < point_used.size(); ++i) {
    if (point_used[i]) ordering->AddElementToGroup(problem->points[i].data(), 0);
  }
  for (std::size_t i = 0; i < cameras->blocks.size(); ++i) {
    if (!cameras->used[i]) continue;
    ordering->AddElementToGroup(cameras->blocks[i].data(), 1);
    if (!std::binary_search(cameras->free.begin(), cameras->free.end(), static_cast<int>(i)))
      full.SetParameterBlockConstant(cameras->blocks[i].data());
  }
  CancelCallback cancel(options.cancel);
  ceres::Solver::Options solver = solver_options(options, &cancel);
  // Below some 60 cameras the reduced camera matrix of a window is nearly full.
  solver.linear_solver_type = cameras->free.size() <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering.reset(ordering.release());
#if CERES_VERSION_MAJOR < 2
  solver.evaluation_callback = &update;
#endif
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &full, &summary);
  BundleReport report;
  report.usable = summary.IsSolutionUsable();
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  report.cancelled = cancel.cancelled();
  return report;
}

namespace {

struct Camera {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

struct ViewingRay {
  int camera;
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 2, 3> weighted;
};

class PointSolver {
 public:
  PointSolver(const BundleOptions& options, const PointStepOptions& steps, const std::vector<Camera>& cameras)
      : options_(options), steps_(steps), loss_(options.loss_width), cameras_(cameras) {
    tolerance_ = steps.tolerance * (loss_.is_robust() ? options.loss_width * options.loss_width : 4);
  }

  // Moves a point to the minimum of its cost. Returns the number of steps.
  int solve(const std::vector<ViewingRay>& rays, Eigen::Vector3d* x, double* initial_cost,
            double* final_cost) const {
    double cost = cost_of(rays, *x);
    *initial_cost = cost;
    double damping = 1e-6;
    int step = 0;
    for (; step < options_.max_iterations; ++step) {
      Eigen::Matrix3d information;
      Eigen::Vector3d gradient;
      linearize(rays, *x, step < steps_.reweighted_steps ? 1 : steps_.min_curvature_ratio, &information,
                &gradient);
      information.diagonal() += damping * information.diagonal();
      const Eigen::Vector3d shift = -information.ldlt().solve(gradient);
      if (!shift.allFinite() || -gradient.dot(shift) < 2 * tolerance_) break;
      const Eigen::Vector3d candidate = *x + shift;
      const double candidate_cost = cost_of(rays, candidate);
      if (candidate_cost < cost) {
        *x = candidate;
        cost = candidate_cost;
        damping = std::max(1e-9, 0.1 * damping);
      } else {
        damping = std::max(1e-3, 10 * damping);
      }
    }
    *final_cost = cost;
    return step;
  }

 private:
  Reprojection reproject(const ViewingRay& ray, const Eigen::Vector3d& x) const {
    const Camera& camera = cameras_[ray.camera];
    return {ray.bearing, ray.weighted, camera.rotation * x + camera.translation};
  }

  double cost_of(const std::vector<ViewingRay>& rays, const Eigen::Vector3d& x) const {
    double cost = 0;
    for (const ViewingRay& s : rays) cost += 0.5 * loss_.cost(reproject(s, x).residual.squaredNorm());
    return cost;
  }

  void linearize(const std::vector<ViewingRay>& rays, const Eigen::Vector3d& x, double min_curvature_ratio,
                 Eigen::Matrix3d* information, Eigen::Vector3d* gradient) const {
    information->setZero();
    gradient->setZero();
    for (const ViewingRay& ray : rays) {
      const Reprojection p = reproject(ray, x);
      if (!p.in_front) continue;
      const double s = p.residual.squaredNorm(), derivative = loss_.derivative(s);
      const Eigen::Matrix<double, 2, 3> j = p.by_point * cameras_[ray.camera].rotation;
      const Eigen::Vector3d along = j.transpose() * p.residual;
      *gradient += derivative * along;
      *information += derivative * (j.transpose() * j);
      if (s > 0)
        *information -= derivative * (1 - loss_.curvature_ratio(s, min_curvature_ratio)) / s *
                        (along * along.transpose());
    }
  }

  const BundleOptions& options_;
  const PointStepOptions& steps_;
  const Loss loss_;
  const std::vector<Camera>& cameras_;
  double tolerance_;
};

// Observations sorted by point: those of point p are order[begin[p]] up to order[begin[p + 1]].
struct ByPoint {
  std::vector<int> begin, order;

  explicit ByPoint(const BundleProblem& problem) : begin(problem.points.size() + 2, 0) {
    for (const BundleObservation& o : problem.observations) ++begin[o.point + 2];
    for (std::size_t p = 2; p < begin.size(); ++p) begin[p] += begin[p - 1];
    order.resize(problem.observations.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      order[begin[problem.observations[i].point + 1]++] = static_cast<int>(i);
  }
};

}  // namespace

BundleReport adjust_points(const BundleOptions& options, BundleProblem* problem,
                           const PointStepOptions& steps) {
  options.validate();
  BundleReport report;
  std::vector<Camera> cameras;
  for (const BundleCamera& c : problem->cameras)
    cameras.push_back({c.camera_from_map.rotation_matrix(), c.camera_from_map.translation});
  const PointSolver solver(options, steps, cameras);
  const ByPoint by_point(*problem);
  std::vector<ViewingRay> rays;
  for (std::size_t p = 0; p < problem->points.size(); ++p) {
    rays.clear();
    for (int i = by_point.begin[p]; i < by_point.begin[p + 1]; ++i) {
      const BundleObservation& o = problem->observations[by_point.order[i]];
      const Camera& camera = cameras[o.camera];
      const double along = o.bearing.dot(camera.rotation * problem->points[p] + camera.translation);
      if (is_usable(o) && along > 0) rays.push_back({o.camera, o.bearing, o.pixel_from_bearing / o.sigma_px});
    }
    if (rays.size() < 2) continue;
    report.usable = true;
    double initial = 0, final = 0;
    report.iterations =
        std::max(report.iterations, solver.solve(rays, &problem->points[p], &initial, &final));
    report.initial_cost += initial;
    report.final_cost += final;
  }
  return report;
}

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
