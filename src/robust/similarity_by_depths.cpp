// A similarity by how well both maps know the depths of their points.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "levenberg_marquardt.h"
#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/robust/similarity.h"
#include "sight_error.h"

namespace mono_pose_tracker {

namespace {

constexpr int kIterations = 20;
constexpr int kFewest = 4;  // three fit some similarity nearly always

using Information = Eigen::Matrix<double, kSimilarityParameters, kSimilarityParameters>;

// Of a match, both ways.
struct BothErrors {
  BothErrors(const SimilarityMatch& m, const Sim3& b_from_a, const Sim3& a_from_b, double sigma)
      : in_a(m.in_a, a_from_b * m.in_b.x, a_from_b * m.in_b.center, m.in_b.depth_sigma, sigma),
        in_b(m.in_b, b_from_a * m.in_a.x, b_from_a * m.in_a.center, m.in_a.depth_sigma, sigma) {}

  SightError in_a, in_b;
};

struct ByDepths {
  const std::vector<SimilarityMatch>& matches;
  double threshold;

  BothErrors errors(const SimilarityMatch& match, const Sim3& b_from_a, const Sim3& a_from_b) const {
    return BothErrors(match, b_from_a, a_from_b, threshold / SimilarityOptions::kThresholdSigmas);
  }

  double cost(const Sim3& b_from_a) const {
    const Sim3 a_from_b = b_from_a.inverse();
    const double limit = threshold * threshold;
    double cost = 0;
    for (const SimilarityMatch& m : matches) {
      const BothErrors e = errors(m, b_from_a, a_from_b);
      cost += 0.5 * (std::min(e.in_a.squared(), limit) + std::min(e.in_b.squared(), limit));
    }
    return cost;
  }

  SimilarityEquations linearize(const Sim3& b_from_a) const {
    const Sim3 a_from_b = b_from_a.inverse();
    SimilarityEquations equations;
    for (const SimilarityMatch& m : matches) add(m, b_from_a, a_from_b, &equations);
    return equations;
  }

  // Either side that lies within the threshold: the truncated cost's gradient.
  void add(const SimilarityMatch& match, const Sim3& b_from_a, const Sim3& a_from_b,
           SimilarityEquations* equations) const {
    const Eigen::Matrix3d turn_to_a = a_from_b.scale * a_from_b.rotation.toRotationMatrix();
    // The inverse takes the step back from the point in b before it takes the point to a.
    const auto dx_in_a = [&](const Eigen::Vector3d& x) -> PointDerivative {
      return -turn_to_a * step_jacobian(b_from_a * x);
    };
    const double limit = threshold * threshold;
    const BothErrors e = errors(match, b_from_a, a_from_b);
    if (e.in_b.squared() < limit) e.in_b.add_to(equations, step_jacobian);
    if (e.in_a.squared() < limit) e.in_a.add_to(equations, dx_in_a);
  }

  Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) const {
    return mono_pose_tracker::stepped(b_from_a, step);
  }
};

bool is_same_point(const SimilarityMatch& a, const SimilarityMatch& b) {
  return a.in_a.x == b.in_a.x && a.in_b.x == b.in_b.x;
}

// By how the gradients of whole points scatter (Huber 1967): the errors of a point, both ways and in all its
// sights, share what its depths are off by.
Information covariance_of(const ByDepths& problem, const Sim3& b_from_a) {
  const Sim3 a_from_b = b_from_a.inverse();
  Information information = Information::Zero(), scatter = Information::Zero();
  const std::vector<SimilarityMatch>& matches = problem.matches;
  int points = 0;
  for (std::size_t i = 0; i < matches.size(); ++points) {
    SimilarityEquations of_point;
    const std::size_t first = i;
    for (; i < matches.size() && is_same_point(matches[first], matches[i]); ++i)
      problem.add(matches[i], b_from_a, a_from_b, &of_point);
    information += of_point.information;
    scatter += of_point.gradient * of_point.gradient.transpose();
  }
  // A point tells three of the seven.
  const double redundancy = 3.0 * points - kSimilarityParameters;
  if (redundancy <= 0) return Information::Constant(std::numeric_limits<double>::infinity());
  const Information inverse = information.ldlt().solve(Information::Identity());
  return 3 * points / redundancy * inverse * scatter * inverse;
}

}  // namespace

SimilarityReport refine_similarity_by_depths(const std::vector<SimilarityMatch>& matches,
                                             const SimilarityOptions& options, const Sim3& start) {
  const double threshold = options.ransac.threshold, limit = threshold * threshold;
  SimilarityReport report;
  report.b_from_a = start;
  report.inliers.assign(matches.size(), 0);
  report.score = levenberg_marquardt(ByDepths{matches, threshold}, {kIterations, 1e-9, 0}, &report.b_from_a);
  const Sim3 a_from_b = report.b_from_a.inverse();
  std::vector<SimilarityMatch> inliers;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const BothErrors e = ByDepths{matches, threshold}.errors(matches[i], report.b_from_a, a_from_b);
    report.inliers[i] = e.in_a.squared() < limit && e.in_b.squared() < limit;
    if (report.inliers[i]) inliers.push_back(matches[i]);
  }
  report.num_inliers = static_cast<int>(inliers.size());
  if (report.num_inliers < kFewest) return report;
  const Information covariance = covariance_of({inliers, threshold}, report.b_from_a);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(covariance.topLeftCorner<3, 3>());
  report.rotation_sigma_deg = std::sqrt(std::max(0.0, turns.eigenvalues()(2))) / kDegree;
  report.scale_sigma = std::sqrt(std::max(0.0, covariance(6, 6)));
  report.success = report.rotation_sigma_deg <= options.max_rotation_sigma_deg &&
                   report.scale_sigma <= options.max_scale_sigma;
  return report;
}

}  // namespace mono_pose_tracker
