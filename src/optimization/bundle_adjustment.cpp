#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <ceres/ceres.h>
#include <ceres/version.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "cancel_callback.h"
#include "mono_pose_tracker/optimization/point_adjustment.h"
#include "reprojection.h"
#include "solver_log.h"

namespace mono_pose_tracker {

namespace {

// A pose block: a turn w of the camera in its place, and how far it moves, both from where it began and along
// its own axes. It is its own tangent, so that all blocks have six parameters, of which Ceres has compiled
// code, and no derivative is multiplied by another. A turn about the map's origin instead would move a camera
// far from it by much more than it turns, and damping would keep it from turning at all.
using PoseBlock = std::array<double, 6>;

// What all observations of a camera share at the parameters under evaluation.
struct CameraState {
  Eigen::Matrix3d start_rotation;  // camera_from_map, as it began
  Eigen::Vector3d start_translation;
  Eigen::Matrix3d rotation;  // camera_from_map; exp(w) start_rotation
  Eigen::Vector3d translation;
  Eigen::Vector3d moved;          // v, of translation = exp(w) start_translation + v
  Eigen::Matrix3d left_jacobian;  // of exp at w
  // Of the block's parameters one that must stay, or -1: its derivatives are left out, and Ceres finds no
  // reason to move it, while all blocks keep the same size.
  int held = -1;

  void update(const PoseBlock& block) {
    const Eigen::Vector3d w(block[0], block[1], block[2]);
    moved << block[3], block[4], block[5];
    const double a2 = w.squaredNorm(), a = std::sqrt(a2);
    // sin(a) / a, (1 - cos(a)) / a^2, (a - sin(a)) / a^3; below 1e-3 their series end beyond rounding.
    double s = 1 - a2 / 6, c = 0.5 - a2 / 24, d = 1.0 / 6 - a2 / 120;
    if (a > 1e-3) s = std::sin(a) / a, c = (1 - std::cos(a)) / a2, d = (1 - s) / a2;
    const Eigen::Matrix3d cross = cross_matrix(w), cross2 = cross * cross;
    const Eigen::Matrix3d turn = Eigen::Matrix3d::Identity() + s * cross + c * cross2;
    rotation = turn * start_rotation;
    translation = turn * start_translation + moved;
    left_jacobian = Eigen::Matrix3d::Identity() + c * cross + d * cross2;
  }
};

// Ceres calls it before it evaluates at new parameters.
class CameraUpdate : public ceres::EvaluationCallback {
 public:
  CameraUpdate(const std::vector<PoseBlock>& blocks, std::vector<CameraState>* states)
      : blocks_(blocks), states_(*states) {}

  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (!new_evaluation_point) return;
    for (std::size_t i = 0; i < blocks_.size(); ++i) states_[i].update(blocks_[i]);
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
      const Eigen::Vector3d turned = x_in_camera - camera_.moved;
      Eigen::Matrix<double, 2, 3> by_turn;
      for (int row = 0; row < 2; ++row)
        by_turn.row(row) = turned.cross(p.by_point.row(row).transpose()).transpose();
      j.leftCols<3>() = by_turn * camera_.left_jacobian;
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

bool has_constant_camera(const BundleProblem& problem) {
  return std::any_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const BundleCamera& c) { return c.constant; });
}

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

// A problem as Ceres has it.
class CeresBundle {
 public:
  CeresBundle(const BundleOptions& options, BundleProblem* problem)
      : blocks_(problem->cameras.size()),
        states_(problem->cameras.size()),
        update_(blocks_, &states_),
        problem_(problem_options(&update_)) {
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const Rigid3& pose = problem->cameras[i].camera_from_map;
      blocks_[i] = {};
      states_[i].start_rotation = pose.rotation_matrix();
      states_[i].start_translation = pose.translation;
      states_[i].update(blocks_[i]);
    }
    add_observations(options.loss_width, problem);
    hold_cameras(*problem);
  }

  bool is_empty() const { return problem_.NumResidualBlocks() == 0; }

  ceres::Solver::Summary solve(const BundleOptions& options, CancelCallback* cancel) {
    ceres::Solver::Options solver;
    // Below some 60 cameras the reduced camera matrix of a window is nearly full.
    const auto free_cameras = std::count(free_.begin(), free_.end(), 1);
    solver.linear_solver_type = free_cameras <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    // Given, so that Ceres does not look for it in a graph of all residuals.
    solver.linear_solver_ordering.reset(ordering_.release());
    solver.max_num_iterations = options.max_iterations;
    solver.max_solver_time_in_seconds = options.max_seconds;
    solver.max_trust_region_radius = kMaxTrustRegionRadius;
    solver.function_tolerance = options.function_tolerance;
    solver.num_threads = options.num_threads;
    solver.logging_type = ceres::SILENT;
    silence_solver_log();
    if (options.cancel) solver.callbacks.push_back(cancel);
#if CERES_VERSION_MAJOR < 2
    solver.evaluation_callback = &update_;
#endif
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    return summary;
  }

  bool is_free(std::size_t camera) const { return free_[camera]; }
  Rigid3 pose(std::size_t camera) const {
    CameraState state = states_[camera];
    state.update(blocks_[camera]);
    return {Eigen::Quaterniond(state.rotation).normalized(), state.translation};
  }

 private:
  static ceres::Problem::Options problem_options(ceres::EvaluationCallback* update) {
    ceres::Problem::Options options;
#if CERES_VERSION_MAJOR >= 2
    options.evaluation_callback = update;
#else
    static_cast<void>(update);  // given to the solver
#endif
    options.disable_all_safety_checks = true;  // the blocks are ours, and apart
    return options;
  }

  void add_observations(double loss_width, BundleProblem* problem) {
    ceres::LossFunction* loss = loss_width > 0 ? new ceres::CauchyLoss(loss_width) : nullptr;
    std::vector<char> point_used(problem->points.size(), 0);
    camera_used_.assign(blocks_.size(), 0);
    free_ = camera_used_;
    for (const BundleObservation& o : problem->observations) {
      if (!is_usable(o) || !is_in_front(*problem, o)) continue;
      problem_.AddResidualBlock(new ReprojectionCost(o, states_[o.camera]), loss, blocks_[o.camera].data(),
                                problem->points[o.point].data());
      camera_used_[o.camera] = point_used[o.point] = 1;
    }
    if (is_empty()) delete loss;
    for (std::size_t i = 0; i < point_used.size(); ++i) {
      if (point_used[i]) ordering_->AddElementToGroup(problem->points[i].data(), 0);
    }
  }

  void hold_cameras(const BundleProblem& problem) {
    const bool held_by_others = has_constant_camera(problem);
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (!camera_used_[i]) continue;
      ordering_->AddElementToGroup(blocks_[i].data(), 1);
      if (problem.cameras[i].constant || (!held_by_others && i == 0)) {
        problem_.SetParameterBlockConstant(blocks_[i].data());
      } else {
        free_[i] = 1;
      }
    }
    if (!held_by_others) hold_scale(problem);
  }

  // Of the camera farthest from the first, the coordinate of its movement that a change of scale about the
  // first would take most of. With the scale free, Ceres' steps along what a narrow view leaves nearly open
  // (depth against turns) go astray: heads seen through a long lens end reversed.
  void hold_scale(const BundleProblem& problem) {
    const Eigen::Vector3d first = problem.cameras[0].camera_from_map.inverse().translation;
    Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
    std::size_t camera = 0;
    for (std::size_t i = 1; i < blocks_.size(); ++i) {
      const Eigen::Vector3d moved = problem.cameras[i].camera_from_map * first;
      if (moved.norm() > farthest.norm()) farthest = moved, camera = i;
    }
    int coordinate = 0;
    farthest.cwiseAbs().maxCoeff(&coordinate);
    if (free_[camera]) states_[camera].held = 3 + coordinate;
  }

  std::vector<PoseBlock> blocks_;
  std::vector<CameraState> states_;
  CameraUpdate update_;
  ceres::Problem problem_;
  std::unique_ptr<ceres::ParameterBlockOrdering> ordering_{new ceres::ParameterBlockOrdering};
  std::vector<char> camera_used_, free_;
};

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
  BundleReport report;
  BundleProblem adjusted{problem->cameras, problem->points, problem->observations};
  CeresBundle bundle(options, &adjusted);
  if (bundle.is_empty()) return report;
  CancelCallback cancel(options.cancel);
  const ceres::Solver::Summary summary = bundle.solve(options, &cancel);
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  report.cancelled = cancel.cancelled();
  for (std::size_t i = 0; i < adjusted.cameras.size(); ++i) {
    if (bundle.is_free(i)) adjusted.cameras[i].camera_from_map = bundle.pose(i);
  }
  report.usable =
      summary.IsSolutionUsable() && report.final_cost <= report.initial_cost && is_finite(adjusted);
  if (!report.usable) return report;
  problem->cameras = std::move(adjusted.cameras);
  problem->points = std::move(adjusted.points);
  return report;
}

}  // namespace mono_pose_tracker
