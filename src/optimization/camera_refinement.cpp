#include "optimization/camera_refinement.h"

#include <ceres/ceres.h>
#include <ceres/version.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bundle_solvers.h"
#include "camera/distortion.h"
#include "ceres_solver.h"
#include "common/rotation.h"
#include "common/statistics.h"
#include "map_adjustment.h"
#include "reduced_system.h"

namespace mono_pose_tracker {
namespace {

// How this version of Ceres updates a pose block [qx qy qz qw tx ty tz]: by a left rotation vector w, q' =
// exp(w) q, and t' = t + v. Cost functions write their Jacobians with respect to (w, v) in the first six
// columns; the plus-Jacobian is [I; 0], so that Ceres passes them on unchanged.
inline void pose_plus(const double* x, const double* delta, double* x_plus_delta) {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  const Eigen::Quaterniond turn = exp_so3(Eigen::Map<const Eigen::Vector3d>(delta));
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (turn * q).normalized();
  for (int i = 4; i < 7; ++i) x_plus_delta[i] = x[i] + delta[i - 1];
}

inline void pose_plus_jacobian(double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
}

#if CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1)

class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(jacobian);
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Eigen::Map<const Eigen::Quaterniond> qy(y), qx(x);
    const Eigen::AngleAxisd turn(qy * qx.conjugate());
    Eigen::Map<Eigen::Vector3d> w(y_minus_x);
    w = turn.angle() * turn.axis();
    for (int i = 4; i < 7; ++i) y_minus_x[i - 1] = y[i] - x[i];
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

inline void set_pose_parameterization(double* block, ceres::Problem* problem) {
  problem->SetManifold(block, new PoseManifold);
}

#else

class PoseParameterization : public ceres::LocalParameterization {
 public:
  int GlobalSize() const override { return 7; }
  int LocalSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    pose_plus(x, delta, x_plus_delta);
    return true;
  }
  bool ComputeJacobian(const double*, double* jacobian) const override {
    pose_plus_jacobian(jacobian);
    return true;
  }
};

inline void set_pose_parameterization(double* block, ceres::Problem* problem) {
  problem->SetParameterization(block, new PoseParameterization);
}

#endif

// d residual / d (w, v) of x_in_camera = exp(w) rotated + t + v, from d residual / d x_in_camera.
template <typename Jacobian>
void pose_jacobian(const Eigen::Matrix<double, 2, 3>& dr_dx, const Eigen::Vector3d& rotated, Jacobian* j) {
  *j << by_turn(dr_dx, rotated), dr_dx, Eigen::Vector2d::Zero();
}

constexpr int kParameters = kCalibrationParameters;
using Information = Eigen::Matrix<double, kParameters, kParameters>;
using Active = std::array<bool, kParameters>;

// Groups of parameters that are refined together or not at all.
constexpr Active kFocal = {true, false, false, false, false};
constexpr Active kFocalDistortion = {true, false, false, true, true};
constexpr Active kAll = {true, true, true, true, true};

struct Observed {
  int camera = -1, point = -1;
  Eigen::Vector2d pixel;
  double sigma_px = 1;
};

using PoseBlock = std::array<double, 7>;

struct Problem {
  std::vector<PoseBlock> poses;  // the first stays
  std::vector<Eigen::Vector3d> points;
  std::vector<Observed> observations;
  CalibrationStep step = CalibrationStep::Zero();
};

Eigen::Matrix3d rotation_of(const PoseBlock& b) {
  return Eigen::Quaterniond(b[3], b[0], b[1], b[2]).normalized().toRotationMatrix();
}

Eigen::Vector3d translation_of(const PoseBlock& b) { return {b[4], b[5], b[6]}; }

// Reprojection error in sigmas, by pose, point and camera.
class CalibratingCost : public ceres::SizedCostFunction<2, 7, 3, kParameters> {
 public:
  CalibratingCost(const CalibratingCamera& start, const Active& active, const Observed& observed)
      : start_(start), active_(active), o_(observed) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4), x_in_map(parameters[1]);
    const Eigen::Matrix3d rotation = q.toRotationMatrix();
    const Eigen::Vector3d rotated = rotation * x_in_map;
    const CalibrationStep step = Eigen::Map<const CalibrationStep>(parameters[2]);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_point;
    Eigen::Matrix<double, 2, kParameters> by_step;
    if (!start_.project(step, rotated + t, &pixel, &by_point, &by_step)) return false;
    Eigen::Map<Eigen::Vector2d> r(residuals);
    r = (pixel - o_.pixel) / o_.sigma_px;
    if (!jacobians) return true;
    by_point /= o_.sigma_px;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> j(jacobians[0]);
      pose_jacobian(by_point, rotated, &j);
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = by_point * rotation;
    }
    if (jacobians[2]) {
      Eigen::Map<Eigen::Matrix<double, 2, kParameters, Eigen::RowMajor>> j(jacobians[2]);
      j = by_step / o_.sigma_px;
      for (int i = 0; i < kParameters; ++i) {
        if (!active_[i]) j.col(i).setZero();
      }
    }
    return true;
  }

 private:
  const CalibratingCamera& start_;
  const Active active_;
  const Observed o_;
};

std::vector<KeyframeId> chosen_keyframes(const Map& map, const CameraRefinementOptions& options) {
  std::vector<std::pair<std::int64_t, KeyframeId>> by_time;
  for (const auto& [id, keyframe] : map.keyframes()) by_time.emplace_back(keyframe.frame_index, id);
  std::sort(by_time.begin(), by_time.end());
  const int surplus = std::max(static_cast<int>(by_time.size()) - options.max_keyframes, 0);
  const auto count = static_cast<double>(by_time.size()) - surplus;
  const auto first = static_cast<std::size_t>(options.begin * count);
  const auto last = static_cast<std::size_t>(options.end * count);
  std::vector<KeyframeId> chosen;
  for (std::size_t i = 0; i < by_time.size() - surplus; ++i) {
    const bool is_in_part = i >= first && i < last;
    if (is_in_part != options.is_part_excluded) chosen.push_back(by_time[surplus / 2 + i].second);
  }
  return chosen;
}

Problem build(const CameraRefinementOptions& options, const CameraModel& camera, const Map& map) {
  Problem problem;
  std::unordered_map<KeyframeId, int> camera_of;
  const std::vector<KeyframeId> keyframes = chosen_keyframes(map, options);
  for (const KeyframeId id : keyframes) {
    camera_of[id] = static_cast<int>(problem.poses.size());
    const Rigid3& pose = map.keyframe(id)->camera_from_map;
    const Eigen::Quaterniond& q = pose.rotation;
    const Eigen::Vector3d& t = pose.translation;
    problem.poses.push_back({q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()});
  }
  for (const LandmarkId id : most_observed_landmarks(map, keyframes, options.max_landmarks)) {
    const Landmark& landmark = *map.landmark(id);
    std::vector<Observed> seen;
    for (const Observation& o : landmark.observations) {
      const auto found = camera_of.find(o.keyframe);
      if (found == camera_of.end()) continue;
      const Keyframe& keyframe = *map.keyframe(o.keyframe);
      Eigen::Vector2d pixel;
      if (!camera.project(keyframe.camera_from_map * landmark.x_in_map, &pixel)) continue;
      seen.push_back({found->second, static_cast<int>(problem.points.size()),
                      keyframe.image->set.features[o.feature].pixel.cast<double>(),
                      static_cast<double>(keyframe.image->sigma_px[o.feature])});
    }
    // Two views do not constrain the camera: the point's depth absorbs any change.
    if (seen.size() < 3) continue;
    problem.points.push_back(landmark.x_in_map);
    problem.observations.insert(problem.observations.end(), seen.begin(), seen.end());
  }
  return problem;
}

// Norms of the residuals in sigmas; views with the point behind them are ignored.
std::vector<double> residual_lengths(const CameraModel& camera, const Problem& problem) {
  std::vector<double> lengths;
  lengths.reserve(problem.observations.size());
  for (const Observed& o : problem.observations) {
    const PoseBlock& pose = problem.poses[o.camera];
    Eigen::Vector2d pixel;
    const bool seen =
        camera.project(rotation_of(pose) * problem.points[o.point] + translation_of(pose), &pixel);
    lengths.push_back(seen ? (pixel - o.pixel).norm() / o.sigma_px : 0);
  }
  return lengths;
}

// The scale is held by the solver's damping; no result here depends on it.
bool solve(const CameraRefinementOptions& options, const CalibratingCamera& start, const Active& active,
           double width, Problem* problem) {
  // The problem would leak a loss that no residual uses.
  const auto loss = width > 0 ? std::make_unique<ceres::CauchyLoss>(width) : nullptr;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(ownership);
  for (const Observed& o : problem->observations) {
    ceres_problem.AddResidualBlock(new CalibratingCost(start, active, o), loss.get(),
                                   problem->poses[o.camera].data(), problem->points[o.point].data(),
                                   problem->step.data());
  }
  auto* order = new ceres::ParameterBlockOrdering;
  for (Eigen::Vector3d& point : problem->points) order->AddElementToGroup(point.data(), 0);
  for (const Observed& o : problem->observations) {
    order->AddElementToGroup(problem->poses[o.camera].data(), 1);
  }
  order->AddElementToGroup(problem->step.data(), 1);
  for (std::size_t i = 0; i < problem->poses.size(); ++i) {
    double* pose = problem->poses[i].data();
    if (!ceres_problem.HasParameterBlock(pose)) continue;
    if (i == 0) {
      ceres_problem.SetParameterBlockConstant(pose);
    } else {
      set_pose_parameterization(pose, &ceres_problem);
    }
  }
  ceres::Solver::Options solver;
  solver.linear_solver_ordering.reset(order);
  // The camera meets every view: the reduced system is nearly full all the same.
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  // What Ceres allows by itself: no image waits for this.
  solver.max_num_iterations = 50;
  solver.function_tolerance = options.function_tolerance;
  solver.max_trust_region_radius = kMaxTrustRegionRadius;
  solver.num_threads = options.num_threads;
  solver.logging_type = ceres::SILENT;
  silence_solver_log();
  CancelCallback cancel(options.cancel);
  if (options.cancel) solver.callbacks.push_back(&cancel);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  return summary.IsSolutionUsable() && !cancel.cancelled();
}

// Information on the camera, marginal over poses and points.
Information marginal_information(const CalibratingCamera& camera, double width, const Problem& problem) {
  const int poses = static_cast<int>(problem.poses.size()) - 1;  // the first is held
  ReducedSystem system(poses, kParameters, width);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const Observed& o = problem.observations[i];
    const PoseBlock& pose = problem.poses[o.camera];
    const Eigen::Matrix3d rotation = rotation_of(pose);
    const Eigen::Vector3d rotated = rotation * problem.points[o.point];
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_x;
    Eigen::Matrix<double, 2, kParameters> by_step;
    if (camera.project(problem.step, rotated + translation_of(pose), &pixel, &by_x, &by_step)) {
      by_x /= o.sigma_px;
      Eigen::Matrix<double, 2, 7> by_pose;
      pose_jacobian(by_x, rotated, &by_pose);
      system.add(o.camera - 1, by_pose.leftCols<6>(), by_x * rotation, by_step / o.sigma_px,
                 (pixel - o.pixel) / o.sigma_px);
    }
    if (i + 1 == problem.observations.size() || problem.observations[i + 1].point != o.point) {
      system.eliminate_point();
    }
  }
  if (poses == 0 || system.variance() <= 0) return Information::Zero();
  return system.shared_information() / system.variance();
}

// Variances of the refined parameters with the others constant; infinite if unobservable.
CalibrationStep sigmas(const Information& information, const Active& active) {
  std::vector<int> used;
  for (int i = 0; i < kParameters; ++i) {
    if (active[i]) used.push_back(i);
  }
  Eigen::MatrixXd part(used.size(), used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    for (std::size_t j = 0; j < used.size(); ++j) part(i, j) = information(used[i], used[j]);
  }
  CalibrationStep result = CalibrationStep::Zero();
  const std::optional<Eigen::MatrixXd> covariance = inverse_of_positive(part);
  for (std::size_t i = 0; i < used.size(); ++i) {
    result[used[i]] = covariance ? std::sqrt((*covariance)(i, i)) : std::numeric_limits<double>::infinity();
  }
  return result;
}

// Undistorted radius (equidistant: angle) of the image's corners.
double corner_radius(const CameraParameters& p) { return 0.5 * std::hypot(p.width / p.fx, p.height / p.fy); }

/// What a step of k1 and k2 moves the corners by, beyond what it moves the points half way to them [px].
CalibrationStep corner_shift_by_step(const CameraParameters& p) {
  const double r = corner_radius(p), r2 = r * r, half2 = 0.25 * r2;
  const double px = 0.5 * (p.fx + p.fy) * r;
  CalibrationStep by_step = CalibrationStep::Zero();
  by_step[3] = px * (r2 - half2);
  by_step[4] = px * (r2 * r2 - half2 * half2);
  return by_step;
}

void ask_distortion(const CameraParameters& camera, const CalibrationStep& step,
                    const Information& information, CameraRefinement* result) {
  const CalibrationStep by_step = corner_shift_by_step(camera);
  result->distortion_asked_px = by_step.dot(step);
  const std::optional<Eigen::MatrixXd> covariance = inverse_of_positive(information);
  if (covariance) result->distortion_sigma_px = std::sqrt(by_step.dot(*covariance * by_step));
}

// Largest standard deviation of parameters that count as observable.
constexpr double kMaxCenterSigma = 0.003;      // of the image's width
constexpr double kMaxDistortionSigma = 0.003;  // of the corner's radius

// Whether the parameters are observable; constant ones have sigma 0.
bool is_known(const CameraParameters& p, const CalibrationStep& sigma) {
  const double r = corner_radius(p), r2 = r * r;
  return sigma[0] < kMaxFocalSigma && std::max(sigma[1], sigma[2]) < kMaxCenterSigma * p.width &&
         std::max(sigma[3] * r2, sigma[4] * r2 * r2) < kMaxDistortionSigma;
}

// Largest distance of a pixel of the image's edge from its position in the other camera.
double edge_shift_px(const CameraModel& a, const CameraModel& b) {
  constexpr int kSteps = 8;
  double farthest = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (a.width() - 1.0) * i / kSteps, y = (a.height() - 1.0) * i / kSteps;
    for (const Eigen::Vector2d& edge : {Eigen::Vector2d(x, 0), Eigen::Vector2d(x, a.height() - 1),
                                        Eigen::Vector2d(0, y), Eigen::Vector2d(a.width() - 1, y)}) {
      Eigen::Vector2d pixel;
      const bool seen = b.project(a.bearing(edge), &pixel);
      farthest = std::max(farthest, seen ? (pixel - edge).norm() : a.width());
    }
  }
  return farthest;
}

// A pixel's bearing leads back to it to 1e-9 px or, where the distortion does not reach that far, to where it
// ends or to nothing: any bound between rounding and a pixel tells the two apart.
constexpr double kMaxRoundTripPx = 0.1;

// The moved camera; nothing where its distortion does not grow up to the image's corners, as a lens' does.
std::optional<CameraModel> sound_camera(const CalibratingCamera& start, const CalibrationStep& step) {
  try {
    const CameraModel camera(start.moved(step));
    if (edge_shift_px(camera, camera) < kMaxRoundTripPx) return camera;
  } catch (const std::invalid_argument&) {
  }
  return std::nullopt;
}

// Costs of the points after an adjustment with a focal length of their own; none where there is no solution.
std::vector<double> adjusted_costs(const CameraRefinementOptions& options, const CameraParameters& camera,
                                   double width, Problem problem) {
  const CalibratingCamera calibrating(camera);
  // The poses come from another camera: the first adjustment takes errors of their size for usual.
  const double first =
      loss_width_by_spread(options.loss_width, residual_lengths(CameraModel(camera), problem));
  if (!solve(options, calibrating, kFocal, first, &problem) ||
      !solve(options, calibrating, kFocal, width, &problem))
    return {};
  const std::optional<CameraModel> adjusted = sound_camera(calibrating, problem.step);
  if (!adjusted) return {};
  const std::vector<double> lengths = residual_lengths(*adjusted, problem);
  std::vector<double> costs(problem.points.size());
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double square = lengths[i] * lengths[i];
    costs[problem.observations[i].point] +=
        width > 0 ? width * width * std::log1p(square / (width * width)) : square;
  }
  return costs;
}

}  // namespace

CameraRefinement refine_camera(const CameraRefinementOptions& options, const CameraParameters& camera,
                               const Map& map) {
  CameraRefinement result;
  result.camera = camera;
  const CameraModel start(camera);
  const CalibratingCamera calibrating(camera);
  Problem problem = build(options, start, map);
  if (problem.observations.empty()) return result;
  double width = loss_width_by_spread(options.loss_width, residual_lengths(start, problem));
  if (!solve(options, calibrating, kFocal, width, &problem)) return result;
  result.focal_asked = calibrating.moved(problem.step).fx / camera.fx - 1;
  result.focal_asked_sigma = sigmas(marginal_information(calibrating, width, problem), kFocal)[0];

  // What is known is asked where all fits best: a distortion that nobody told of is no noise.
  Problem at = problem;
  const bool is_solved =
      solve(options, calibrating, kAll, width, &at) && sound_camera(calibrating, at.step).has_value();
  if (!is_solved) at = problem;
  const std::optional<CameraModel> best = sound_camera(calibrating, at.step);
  if (!best) return result;
  width = loss_width_by_spread(options.loss_width, residual_lengths(*best, at));
  const Information information = marginal_information(calibrating, width, at);
  if (is_solved) ask_distortion(camera, at.step, information, &result);
  if (std::abs(result.focal_asked) < options.least_focal_change &&
      std::abs(result.distortion_asked_px) < options.least_distortion_px) {
    result.focal_sigma = sigmas(information, kAll)[0];
    return result;
  }
  for (const Active& active : {kAll, kFocalDistortion, kFocal}) {
    const CalibrationStep sigma = sigmas(information, active);
    result.focal_sigma = sigma[0];
    if (!is_known(best->parameters(), sigma)) continue;
    Problem full = problem;
    if (!solve(options, calibrating, active, width, &full)) continue;
    const std::optional<CameraModel> refined = sound_camera(calibrating, full.step);
    if (!refined) continue;
    result.focal_observable = true;
    result.center_observable = active[1];
    result.distortion_observable = active[3];
    result.camera = refined->parameters();
    result.focal_change = result.camera.fx / camera.fx - 1;
    result.max_shift_px = edge_shift_px(start, *refined);
    break;
  }
  return result;
}

double p_value_of_worse_fit(const CameraRefinementOptions& options, const CameraParameters& camera,
                            const CameraParameters& alternative, const Map& map, double min_extra_cost) {
  const CameraModel given(camera);
  const Problem problem = build(options, given, map);
  const double width = loss_width_by_spread(options.loss_width, residual_lengths(given, problem));
  const std::vector<double> costs = adjusted_costs(options, camera, width, problem),
                            others = adjusted_costs(options, alternative, width, problem);
  return costs.size() == others.size() ? p_value_of_extra_cost(costs, others, min_extra_cost) : 1;
}

}  // namespace mono_pose_tracker
