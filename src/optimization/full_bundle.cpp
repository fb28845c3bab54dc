#include "full_bundle.h"

#include <ceres/version.h>

#include <algorithm>
#include <memory>

#include "reprojection.h"
#include "solver_options.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
