#include "similarity_certainty.h"

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

bool is_usable(const ObservedPoint& observation) {
  const double norm = observation.bearing.norm();
  return observation.x.allFinite() && observation.center.allFinite() && observation.x != observation.center &&
         std::isfinite(norm) && norm > 0;
}

}  // namespace

void require_options(const SimilarityOptions& options) {
  options.ransac.validate();
  const auto require_positive = [](const char* name, double value) {
    if (value > 0) return;
    throw std::invalid_argument("SimilarityOptions: " + std::string(name) + " = " + std::to_string(value) +
                                ", expected > 0");
  };
  require_positive("max_rotation_sigma_deg", options.max_rotation_sigma_deg);
  require_positive("max_scale_sigma", options.max_scale_sigma);
}

UsableMatches::UsableMatches(const std::vector<SimilarityMatch>& matches) : all(matches.size()) {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!is_usable(matches[i].in_a) || !is_usable(matches[i].in_b)) continue;
    data.push_back(matches[i]);
    data.back().in_a.bearing.normalize();
    data.back().in_b.bearing.normalize();
    source.push_back(i);
  }
}

Uncertainty uncertainty_of(const SimilarityInformation& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(covariance.topLeftCorner<3, 3>());
  return {std::sqrt(std::max(0.0, turns.eigenvalues()(2))), std::sqrt(std::max(0.0, covariance(6, 6)))};
}

Uncertainty greater(const Uncertainty& a, const Uncertainty& b) {
  return {std::max(a.turn, b.turn), std::max(a.scale, b.scale)};
}

SimilarityInformation inverse_of(const SimilarityInformation& information) {
  // Scaled to a unit diagonal, so that what is singular shows whatever the units.
  const SimilarityStep unit = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SimilarityInformation scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<SimilarityInformation> solver(scaled);
  const SimilarityStep inverse = solver.eigenvalues().cwiseMax(1e-14).cwiseInverse();
  return unit.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() *
         solver.eigenvectors().transpose() * unit.asDiagonal();
}

Uncertainty by_points(const std::vector<SimilarityMatch>& inliers, const Sim3& b_from_a) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<double> squares;
  for (const SimilarityMatch& m : inliers) {
    mean += m.in_b.x / inliers.size();
    squares.push_back((b_from_a * m.in_a.x - m.in_b.x).squaredNorm());
  }
  const double variance = variance_of_median_square(median(std::move(squares)));
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const SimilarityMatch& m : inliers) scatter += (m.in_b.x - mean) * (m.in_b.x - mean).transpose();
  const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  // The moment of inertia about the longest axis is what the other two extents make.
  return {std::sqrt(variance / std::max(spread(0) + spread(1), 1e-300)),
          std::sqrt(variance / std::max(spread.sum(), 1e-300))};
}

void judge(const Uncertainty& uncertainty, const SimilarityOptions& options, SimilarityReport* report) {
  report->rotation_sigma_deg = uncertainty.turn / kDegree;
  report->scale_sigma = uncertainty.scale;
  report->success = report->rotation_sigma_deg <= options.max_rotation_sigma_deg &&
                    report->scale_sigma <= options.max_scale_sigma;
}

}  // namespace mono_pose_tracker
