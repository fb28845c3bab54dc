#include "robust/motion_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/rotation.h"
#include "common/statistics.h"

namespace mono_pose_tracker {

namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kMinDistance = 1e-9;  // a point nearer to the camera's centre has no direction

struct Matches {
  const std::vector<Eigen::Vector3d>& bearings;
  const std::vector<Eigen::Vector3d>& points;
  const std::vector<double>& sigmas;
  double common_sigma = 1;  // of every bearing when sigmas is empty

  double weight(std::size_t i) const {
    const double sigma = sigmas.empty() ? common_sigma : sigmas[i];
    return 1 / (sigma * sigma);
  }
  bool usable(std::size_t i) const { return bearings[i].allFinite() && points[i].allFinite(); }
};

// Residual of a match: the chord p / |p| - b between the direction to the point p and the bearing b, which is
// the angle between them to second order and, unlike it, smooth everywhere.
struct Linearization {
  double cost = 0;      // sum of 1/2 c^2 log(1 + s / c^2) over squared residuals s in units of sigma
  Matrix6d majorizing;  // weights rho' = w: steps that descend from afar, but end slowly
  Matrix6d newton;  // weights rho' + s rho'' = w^2, averaged over directions: ends fast, overshoots from afar
  Vector6d gradient;
  Matrix6d information;       // of all residuals, not weighted down: for the covariance
  double sum_influence = 0;   // of squared influence (w r)^2
  double sum_derivative = 0;  // of the influence's derivative, averaged over directions
  int count = 0;
};

double estimate_sigma(const Matches& matches, const Rigid3& pose) {
  std::vector<double> lengths;
  lengths.reserve(matches.points.size());
  for (std::size_t i = 0; i < matches.points.size(); ++i) {
    if (matches.usable(i)) {
      const Eigen::Vector3d p = pose * matches.points[i];
      lengths.push_back((p / std::max(p.norm(), kMinDistance) - matches.bearings[i]).norm());
    }
  }
  if (lengths.empty()) {
    return 1;
  }
  // Exact data: the rounding errors of double precision, and more.
  return std::max(sigma_of_lengths(std::move(lengths)), 1e-12);
}

double robust_cost(const Matches& matches, const Rigid3& pose, double squared_width) {
  const Eigen::Matrix3d rotation = pose.rotation_matrix();
  double cost = 0;
  for (std::size_t i = 0; i < matches.points.size(); ++i) {
    if (!matches.usable(i)) {
      continue;
    }
    const Eigen::Vector3d p = rotation * matches.points[i] + pose.translation;
    const double s =
        matches.weight(i) * (p / std::max(p.norm(), kMinDistance) - matches.bearings[i]).squaredNorm();
    cost += 0.5 * squared_width * std::log1p(s / squared_width);
  }
  return cost;
}

// J = (I - u u^T) / |p| * [I, -[p]x] for the direction u = p / |p|; its products are short in closed form.
Linearization linearize(const Matches& matches, const Rigid3& pose, double squared_width) {
  Linearization sum;
  sum.majorizing.setZero();
  sum.newton.setZero();
  sum.gradient.setZero();
  sum.information.setZero();
  const Eigen::Matrix3d rotation = pose.rotation_matrix();
  for (std::size_t i = 0; i < matches.points.size(); ++i) {
    if (!matches.usable(i)) {
      continue;
    }
    const Eigen::Vector3d p = rotation * matches.points[i] + pose.translation;
    const double distance = p.norm();
    if (distance < kMinDistance) {
      continue;
    }
    const Eigen::Vector3d u = p / distance;
    const double by_sigma = matches.weight(i);
    const double s = by_sigma * (u - matches.bearings[i]).squaredNorm();
    const double w = 1 / (1 + s / squared_width);  // rho'(s) of Cauchy's loss
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - u * u.transpose();
    Matrix6d jtj;
    jtj.topLeftCorner<3, 3>() = across / (distance * distance);
    jtj.topRightCorner<3, 3>() = -cross_matrix(u) / distance;
    jtj.bottomLeftCorner<3, 3>() = -jtj.topRightCorner<3, 3>();
    jtj.bottomRightCorner<3, 3>() = across;
    sum.majorizing += (w * by_sigma) * jtj;
    sum.newton += (w * w * by_sigma) * jtj;
    sum.information += by_sigma * jtj;
    sum.gradient.head<3>() -= (w * by_sigma / distance) * (across * matches.bearings[i]);
    sum.gradient.tail<3>() -= (w * by_sigma) * u.cross(matches.bearings[i]);
    sum.cost += 0.5 * squared_width * std::log1p(s / squared_width);
    sum.sum_influence += w * w * s;
    sum.sum_derivative += w * w;
    ++sum.count;
  }
  return sum;
}

Rigid3 perturbed(const Rigid3& pose, const Vector6d& step) {
  const Eigen::Quaterniond turn = exp_so3(step.tail<3>());
  return {(turn * pose.rotation).normalized(), turn * pose.translation + step.head<3>()};
}

// Covariance of an M-estimator (Huber 1981, section 7.6): the variance factor is the mean squared influence
// over the squared mean slope of the influence, for residuals of two components less six parameters.
bool covariance_of(const Linearization& at, Matrix6d* covariance) {
  const double freedom = 2.0 * at.count - 6.0;
  if (freedom <= 0 || at.sum_derivative <= 0) {
    return false;
  }
  const double mean_derivative = at.sum_derivative / at.count;
  // Residuals of nothing (exact data) still leave rounding errors of double precision.
  const double factor = std::max(at.sum_influence / freedom / (mean_derivative * mean_derivative), 1e-28);
  const Eigen::LDLT<Matrix6d> ldlt(at.information);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) {
    return false;
  }
  *covariance = factor * ldlt.solve(Matrix6d::Identity());
  *covariance = (0.5 * (*covariance + covariance->transpose())).eval();
  return covariance->allFinite();
}

void validate(const Matches& matches, const MotionRefinementOptions& options) {
  if (options.max_iterations < 1 || !(options.loss_width > 0)) {
    throw std::invalid_argument(
        "MotionRefinementOptions: max_iterations must be at least 1 and loss_width positive");
  }
  if (matches.bearings.size() != matches.points.size() ||
      (!matches.sigmas.empty() && matches.sigmas.size() != matches.points.size())) {
    throw std::invalid_argument("refine_absolute_pose: " + std::to_string(matches.bearings.size()) +
                                " bearings, " + std::to_string(matches.points.size()) + " points and " +
                                std::to_string(matches.sigmas.size()) + " sigmas, expected equal numbers");
  }
  for (const double sigma : matches.sigmas) {
    if (!(sigma > 0)) {
      throw std::invalid_argument("refine_absolute_pose: sigma is " + std::to_string(sigma) +
                                  ", expected above 0");
    }
  }
}

// Levenberg-Marquardt; true when it has converged. `at` is left linearised at the pose.
bool minimize(const Matches& matches, const MotionRefinementOptions& options, Rigid3* pose,
              Linearization* at) {
  const double squared_width = options.loss_width * options.loss_width;
  *at = linearize(matches, *pose, squared_width);
  double damping = 1e-4;
  bool newton = false;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    Matrix6d damped = newton ? at->newton : at->majorizing;
    damped.diagonal() *= 1 + damping;
    const Vector6d step = -damped.ldlt().solve(at->gradient);
    if (!step.allFinite()) {
      return false;
    }
    const double expected_decrease = -0.5 * at->gradient.dot(step);
    // A full step that would lower the cost by less than 1e-5 moves the pose by less than a hundredth of its
    // deviation; a damped one may just be short.
    const bool settled = expected_decrease < 1e-5 && damping < 1;
    newton = expected_decrease < options.newton_below * at->cost;
    const Rigid3 candidate = perturbed(*pose, step);
    if (robust_cost(matches, candidate, squared_width) < at->cost) {
      *pose = candidate;
      *at = linearize(matches, candidate, squared_width);
      damping = std::max(1e-9, damping * 0.1);
    } else {
      damping *= 10;
    }
    if (settled) {
      return true;
    }
  }
  return false;
}

}  // namespace

MotionRefinementReport refine_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                            const std::vector<Eigen::Vector3d>& points_in_map,
                                            const std::vector<double>& sigmas,
                                            const Rigid3& initial_camera_from_map,
                                            const MotionRefinementOptions& options) {
  Matches matches{bearings_in_camera, points_in_map, sigmas};
  validate(matches, options);
  MotionRefinementReport report;
  report.camera_from_map = initial_camera_from_map;
  Linearization at;
  // An unknown sigma is first taken from the initial pose's residuals, then from those of the pose that gave.
  for (int round = 0; round < (sigmas.empty() ? 2 : 1); ++round) {
    if (sigmas.empty()) {
      matches.common_sigma = estimate_sigma(matches, report.camera_from_map);
    }
    report.converged = minimize(matches, options, &report.camera_from_map, &at);
  }
  report.final_cost = at.cost;
  report.converged = report.converged && covariance_of(at, &report.covariance);
  if (!report.converged) {
    report.covariance.setZero();
  }
  return report;
}

}  // namespace mono_pose_tracker
