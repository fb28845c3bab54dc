#include "reduced_bundle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "ceres_solver.h"
#include "reduced_system.h"

namespace mono_pose_tracker {
namespace {

// The absolute part keeps the blocks of cameras without observations decomposable.
template <typename Matrix>
void damp(double damping, Matrix&& information) {
  information.diagonal() *= 1 + damping;
  information.diagonal().array() += 1e-300;
}

// Sum of log(1 + u), one logarithm for many.
class LogSum {
 public:
  void add(double u) {
    product_ *= 1 + u;
    if (product_ > 1e150) sum_ += std::log(product_), product_ = 1;
  }
  double value() const { return sum_ + std::log(product_); }

 private:
  double sum_ = 0, product_ = 1;
};

}  // namespace

ReducedBundle::ReducedBundle(double loss_width, const BundleCameras& cameras, const BundleProblem& problem,
                             int threads, const ReducedBundleOptions& limits)
    : loss_(loss_width),
      squared_width_(loss_width * loss_width),
      limits_(limits),
      team_(threads),
      cameras_(cameras.states),
      free_(cameras.free),
      begin_(problem.points.size() + 1, 0),
      rays_(problem.observations.size()),
      free_of_(cameras_.size(), -1),
      candidate_(problem.points),
      candidate_costs_(problem.points.size()),
      accepted_(problem.points),
      followers_(problem.points.size()),
      by_point_(new CameraByPoint[problem.observations.size()]),
      pose_terms_(new PoseTerm[problem.observations.size()]),
      moved_(free_.size()) {
  for (std::size_t i = 0; i < free_.size(); ++i) free_of_[free_[i]] = static_cast<int>(i);
  for (const BundleObservation& o : problem.observations) ++begin_[o.point + 1];
  for (std::size_t p = 0; p < accepted_.size(); ++p) begin_[p + 1] += begin_[p];
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (const BundleObservation& o : problem.observations) {
    rays_[next[o.point]++] = {o.camera, free_of_[o.camera], o.bearing, o.pixel_from_bearing / o.sigma_px};
  }
  team_.for_runs(static_cast<int>(accepted_.size()), limits_.points_at_once,
                 [this](int p) { candidate_costs_[p] = state_of(p, accepted_[p]).cost; });
  for (const double of_point : candidate_costs_) initial_cost_ += of_point;
}

bool ReducedBundle::is_noise(double cost, int num_rays) const {
  return 2 * cost < limits_.out_of_place * squared_width_ * num_rays;
}

bool ReducedBundle::is_near_noise() const {
  return 2 * initial_cost_ < limits_.far_off * squared_width_ * static_cast<double>(rays_.size());
}

ReducedBundle::PointState ReducedBundle::state_of(std::size_t point, const Eigen::Vector3d& x) const {
  PointState state;
  state.information.setZero();
  state.gradient.setZero();
  Eigen::Matrix3d bent = Eigen::Matrix3d::Zero();
  LogSum logs;
  for (int i = begin_[point]; i < begin_[point + 1]; ++i) {
    const ViewingRay& ray = rays_[i];
    const CameraState& camera = cameras_[ray.camera];
    const Reprojection p(ray.bearing, ray.weighted, camera.rotation * x + camera.translation);
    const double s = p.residual.squaredNorm();
    logs.add(s / squared_width_);
    if (!p.in_front) continue;
    const double derivative = loss_.derivative(s);
    const Eigen::Matrix<double, 2, 3> j = p.by_point * camera.rotation;
    const Eigen::Vector3d along = j.transpose() * p.residual;
    state.gradient += derivative * along;
    state.information += derivative * (j.transpose() * j);
    if (s > 0)
      bent += (derivative * (1 - loss_.curvature_ratio(s, limits_.min_curvature_ratio)) / s * along) *
              along.transpose();
  }
  state.cost = 0.5 * squared_width_ * logs.value();
  if (is_noise(state.cost, begin_[point + 1] - begin_[point])) state.information -= bent;
  return state;
}

Eigen::Vector3d ReducedBundle::predict(std::size_t point) const {
  const Follower& follower = followers_[point];
  Eigen::Vector3d shift = follower.residual;
  for (int i = begin_[point]; i < begin_[point + 1]; ++i) {
    if (rays_[i].free >= 0) shift += by_point_[i].transpose() * moved_[rays_[i].free];
  }
  follower.factor.transpose().triangularView<Eigen::Upper>().solveInPlace(shift);
  return accepted_[point] - shift;
}

ReducedBundle::PointState ReducedBundle::begin_at(std::size_t point, Eigen::Vector3d* x) const {
  *x = accepted_[point];
  if (!linearized_) return state_of(point, *x);
  const Eigen::Vector3d predicted = predict(point);
  PointState there = state_of(point, predicted);
  const double expected = accepted_costs_[point] + limits_.suspicious_rise * squared_width_;
  if (!(there.cost <= expected)) {
    PointState here = state_of(point, *x);
    if (!(there.cost <= here.cost)) return here;
  }
  *x = predicted;
  return there;
}

double ReducedBundle::settle(std::size_t point) {
  Eigen::Vector3d& x = candidate_[point];
  if (begin_[point + 1] - begin_[point] < 2) return state_of(point, x).cost;
  PointState state = begin_at(point, &x);
  double damping = 1e-6;
  for (int step = 0; step < limits_.point_steps; ++step) {
    Eigen::Matrix3d information = state.information;
    information.diagonal() *= 1 + damping;
    const Eigen::Vector3d shift = -information.llt().solve(state.gradient);
    const double promised = -0.5 * state.gradient.dot(shift);
    if (!shift.allFinite() || promised < limits_.point_tolerance * squared_width_) break;
    const Eigen::Vector3d moved = x + shift;
    const PointState there = state_of(point, moved);
    if (there.cost < state.cost) {
      x = moved;
      state = there;
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      damping = std::max(1e-3, 10 * damping);
    }
  }
  return state.cost;
}

double ReducedBundle::evaluate(const double* parameters) {
  candidate_parameters_.assign(parameters, parameters + this->parameters());
  for (std::size_t i = 0; i < free_.size(); ++i) {
    cameras_[free_[i]].update(parameters + 6 * i);
    if (!linearized_) continue;
    for (int k = 0; k < 6; ++k) moved_[i][k] = parameters[6 * i + k] - accepted_parameters_[6 * i + k];
    moved_[i].head<3>() = (left_jacobians_[i] * moved_[i].head<3>()).eval();
  }
  double cost = 0;
  team_.for_runs(static_cast<int>(accepted_.size()), limits_.points_at_once,
                 [this](int p) { candidate_costs_[p] = settle(p); });
  for (const double of_point : candidate_costs_) cost += of_point;
  return cost;
}

// Computes the derivatives of the point's observations by poses and point.
void ReducedBundle::linearize_point(std::size_t point) {
  const int begin = begin_[point], end = begin_[point + 1];
  const double least = is_noise(accepted_costs_[point], end - begin) ? limits_.min_curvature_ratio : 1;
  PointState joint;
  joint.information.setZero();
  joint.gradient.setZero();
  for (int i = begin; i < end; ++i) {
    const ViewingRay& ray = rays_[i];
    const CameraState& camera = cameras_[ray.camera];
    const Eigen::Vector3d x_in_camera = camera.rotation * accepted_[point] + camera.translation;
    const Reprojection p(ray.bearing, ray.weighted, x_in_camera);
    by_point_[i].setZero();
    pose_terms_[i].by_pose.setZero();
    pose_terms_[i].residual.setZero();
    if (!p.in_front) continue;
    const double s = p.residual.squaredNorm();
    const double curvature_ratio = std::sqrt(loss_.curvature_ratio(s, least)),
                 weight = std::sqrt(loss_.derivative(s));
    // The derivative along the residual is scaled by `curvature_ratio`, the residual by its inverse.
    Eigen::Matrix<double, 2, 3> scaled = weight * p.by_point;
    if (s > 0) scaled += ((curvature_ratio - 1) / s * p.residual) * (p.residual.transpose() * scaled);
    const Eigen::Vector2d residual = weight / curvature_ratio * p.residual;
    const Eigen::Matrix<double, 2, 3> j = scaled * camera.rotation;
    joint.information += j.transpose() * j;
    joint.gradient += j.transpose() * residual;
    if (ray.free < 0) continue;
    Eigen::Matrix<double, 2, 6>& by_pose = pose_terms_[i].by_pose;
    by_pose << by_turn(scaled, x_in_camera - camera.moved), scaled;
    pose_terms_[i].residual = residual;
    by_point_[i] = by_pose.transpose() * j;
  }
  factorize_point(point, joint);
}

void ReducedBundle::factorize_point(std::size_t point, const PointState& joint) {
  Eigen::Matrix3d information = joint.information;
  damp(limits_.damping, information);
  Follower& follower = followers_[point];
  follower.factor = information.llt().matrixL();
  follower.residual = follower.factor.triangularView<Eigen::Lower>().solve(joint.gradient);
  const Eigen::Matrix3d inverse =
      follower.factor.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
  for (int i = begin_[point]; i < begin_[point + 1]; ++i) {
    if (rays_[i].free >= 0) by_point_[i] = (by_point_[i] * inverse.transpose()).eval();
  }
}

// Subtracts the Schur complement of the point; only the lower triangle is kept.
void ReducedBundle::eliminate_point(std::size_t point, const Part& part, Eigen::MatrixXd* information,
                                    Eigen::VectorXd* gradient) const {
  for (int j = begin_[point]; j < begin_[point + 1]; ++j) {
    if (rays_[j].free < 0 || !part.has(rays_[j].free)) continue;
    const Eigen::Index b = 6 * rays_[j].free;
    gradient->segment<6>(b) -= by_point_[j] * followers_[point].residual;
    for (int i = begin_[point]; i < begin_[point + 1]; ++i) {
      const Eigen::Index a = 6 * rays_[i].free;
      if (a >= b) information->block<6, 6>(a, b) -= by_point_[i] * by_point_[j].transpose();
    }
  }
}

// Fills the columns of one part, which no other part writes to; every sum is in the order of the points.
void ReducedBundle::fill(const Part& part, Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const {
  const auto with_each_point = [&](auto&& step) {
    for (std::size_t p = 0; p < accepted_.size(); ++p) {
      if (begin_[p + 1] - begin_[p] >= 2) step(p);
    }
  };
  with_each_point([&](std::size_t p) {
    for (int i = begin_[p]; i < begin_[p + 1]; ++i) {
      if (rays_[i].free < 0 || !part.has(rays_[i].free)) continue;
      const Eigen::Index at = 6 * rays_[i].free;
      const auto& [by_pose, residual] = pose_terms_[i];
      information->block<6, 6>(at, at) += by_pose.transpose() * by_pose;
      gradient->segment<6>(at) += by_pose.transpose() * residual;
    }
  });
  for (int i = part.first; i < static_cast<int>(free_.size()); i += part.step) {
    damp(limits_.damping, information->block<6, 6>(6 * i, 6 * i));
  }
  with_each_point([&](std::size_t p) { eliminate_point(p, part, information, gradient); });
}

// Converts from rotations about the camera centres to the cameras' parameters; constant parameters are
// cleared.
void ReducedBundle::to_parameters(Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const {
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const Eigen::Index at = 6 * static_cast<Eigen::Index>(i), below = information->rows() - at;
    const Eigen::Matrix3d& turn = left_jacobians_[i];
    information->block(at, at, below, 3) = (information->block(at, at, below, 3) * turn).eval();
    information->block(at, 0, 3, at + 3) = (turn.transpose() * information->block(at, 0, 3, at + 3)).eval();
    gradient->segment<3>(at) = (turn.transpose() * gradient->segment<3>(at)).eval();
    if (cameras_[free_[i]].held < 0) continue;
    const Eigen::Index held = at + cameras_[free_[i]].held;
    information->row(held).setZero();
    information->col(held).setZero();
    (*information)(held, held) = 1;
    (*gradient)[held] = 0;
  }
}

void ReducedBundle::linearize(Eigen::MatrixXd* information, Eigen::VectorXd* gradient) {
  accepted_ = candidate_;
  accepted_costs_ = candidate_costs_;
  accepted_parameters_ = candidate_parameters_;
  left_jacobians_.clear();
  for (const int camera : free_) left_jacobians_.push_back(cameras_[camera].left_jacobian);
  linearized_ = true;
  information->setZero(parameters(), parameters());
  gradient->setZero(parameters());
  team_.for_runs(static_cast<int>(accepted_.size()), limits_.points_at_once, [this](int p) {
    if (begin_[p + 1] - begin_[p] >= 2) linearize_point(p);
  });
  const std::size_t worth = std::min(free_.size(), 1 + rays_.size() / limits_.rays_per_part);
  const int parts = std::clamp(team_.threads(), 1, std::max(1, static_cast<int>(worth)));
  team_.for_each(parts, [&](int part) { fill({part, parts}, information, gradient); });
  to_parameters(information, gradient);
}

namespace {

using Clock = std::chrono::steady_clock;

// Trust region of Levenberg-Marquardt steps, as in Ceres: the damping is the diagonal over the radius
// (Marquardt 1963), which follows the ratio of the reduction of the cost to the predicted one (Nielsen 1999).
class TrustRegion {
 public:
  explicit TrustRegion(const ReducedBundleOptions& limits) : limits_(limits) {}

  double radius() const { return radius_; }
  bool is_empty() const { return radius_ < limits_.min_radius; }
  // Returns whether the step is accepted.
  bool judge(double ratio) {
    if (!(ratio > limits_.min_decrease_ratio)) {
      radius_ /= shrinkage_;
      shrinkage_ *= 2;
      return false;
    }
    radius_ = std::min(kMaxTrustRegionRadius, radius_ / std::max(1.0 / 3, 1 - std::pow(2 * ratio - 1, 3)));
    shrinkage_ = 2;
    return true;
  }

 private:
  const ReducedBundleOptions& limits_;
  double radius_ = 1e4, shrinkage_ = 2;
};

// The step that minimises the damped quadratic model, and the reduction of the cost that the model promises
// for it; 0: the damped matrix is not positive definite.
class Step {
 public:
  Step(const Eigen::MatrixXd& information, const Eigen::VectorXd& gradient, double radius) {
    const Eigen::VectorXd damping = information.diagonal() / radius;
    Eigen::MatrixXd damped = information;
    damped.diagonal() += damping;
    const std::optional<Eigen::VectorXd> step = solve_positive(std::move(damped), -gradient);
    if (!step) return;
    by_ = *step;
    promised_ = 0.5 * (by_.dot(damping.cwiseProduct(by_)) - gradient.dot(by_));
  }

  const Eigen::VectorXd& by() const { return by_; }
  double promised() const { return promised_; }

 private:
  Eigen::VectorXd by_;
  double promised_ = 0;
};

BundleReport minimize(const BundleOptions& options, const ReducedBundleOptions& limits, ReducedBundle* bundle,
                      Eigen::VectorXd* parameters) {
  const auto begin = Clock::now();
  BundleReport report;
  report.initial_cost = bundle->initial_cost();
  report.final_cost = bundle->evaluate(parameters->data());
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  bundle->linearize(&information, &gradient);
  TrustRegion region(limits);
  for (; report.iterations < options.max_iterations && !region.is_empty(); ++report.iterations) {
    report.cancelled = options.is_cancelled();
    if (report.cancelled || std::chrono::duration<double>(Clock::now() - begin).count() > options.max_seconds)
      break;
    const Step step(information, gradient, region.radius());
    if (!(step.promised() > 0)) {
      region.judge(0);
      continue;
    }
    if (step.by().norm() <= limits.min_step * (parameters->norm() + limits.min_step)) break;
    const Eigen::VectorXd candidate = *parameters + step.by();
    const double cost = bundle->evaluate(candidate.data()), reduction = report.final_cost - cost;
    if (std::abs(reduction) <= options.function_tolerance * report.final_cost) break;
    if (!region.judge(reduction / step.promised())) continue;
    *parameters = candidate;
    report.final_cost = cost;
    bundle->linearize(&information, &gradient);
  }
  report.usable = std::isfinite(report.final_cost) && parameters->allFinite();
  return report;
}

}  // namespace

std::optional<BundleReport> solve_reduced(const BundleOptions& options, BundleCameras* cameras,
                                          BundleProblem* problem, const ReducedBundleOptions& limits) {
  const std::vector<int>& free = cameras->free;
  if (!(options.loss_width > 0) || free.empty() || free.size() > limits.max_cameras) return std::nullopt;
  ReducedBundle bundle(options.loss_width, *cameras, *problem, options.own_threads, limits);
  if (!bundle.is_near_noise()) return std::nullopt;
  Eigen::VectorXd parameters(bundle.parameters());
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    parameters.segment<6>(at) =
        Eigen::Map<const Eigen::Matrix<double, 6, 1>>(cameras->blocks[free[i]].data());
  }
  const BundleReport report = minimize(options, limits, &bundle, &parameters);
  for (std::size_t i = 0; i < free.size(); ++i)
    std::copy_n(parameters.data() + 6 * i, 6, cameras->blocks[free[i]].begin());
  problem->points = bundle.points();
  return report;
}

}  // namespace mono_pose_tracker
