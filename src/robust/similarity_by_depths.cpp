// Refinement of a similarity with depth uncertainties (similarity.h).

#include <Eigen/Dense>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "levenberg_marquardt.h"
#include "observation_error.h"
#include "robust/similarity.h"
#include "similarity_certainty.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

namespace {

// The errors of a match in both directions.
struct BothErrors {
  BothErrors(const SimilarityMatch& m, const Sim3& b_from_a, const Sim3& a_from_b, double sigma)
      : in_a(m.in_a, a_from_b * m.in_b.x, a_from_b * m.in_b.center, m.in_b.depth_sigma, sigma),
        in_b(m.in_b, b_from_a * m.in_a.x, b_from_a * m.in_a.center, m.in_a.depth_sigma, sigma) {}

  ObservationError in_a, in_b;
};

struct ByDepths {
  const std::vector<SimilarityMatch>& matches;
  double threshold, sigma;  // of an angle, rad

  BothErrors errors(const SimilarityMatch& match, const Sim3& b_from_a, const Sim3& a_from_b) const {
    return BothErrors(match, b_from_a, a_from_b, sigma);
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

  // Either side that lies within the threshold: the truncated cost's gradient.
  SimilarityEquations linearize(const Sim3& b_from_a) const {
    const Sim3 a_from_b = b_from_a.inverse();
    const Eigen::Matrix3d turn_to_a = a_from_b.scale * a_from_b.rotation.toRotationMatrix();
    // The inverse takes the step back from the point in b before it takes the point to a.
    const auto dx_in_a = [&](const Eigen::Vector3d& x) -> PointDerivative {
      return -turn_to_a * step_jacobian(b_from_a * x);
    };
    const double limit = threshold * threshold;
    SimilarityEquations equations;
    for (const SimilarityMatch& m : matches) {
      const BothErrors e = errors(m, b_from_a, a_from_b);
      if (e.in_b.squared() < limit) e.in_b.add_to(&equations, step_jacobian);
      if (e.in_a.squared() < limit) e.in_a.add_to(&equations, dx_in_a);
    }
    return equations;
  }

  Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) const {
    return mono_pose_tracker::stepped(b_from_a, step);
  }
};

using MatchesOfPoint = std::vector<SimilarityMatch>;

std::vector<MatchesOfPoint> by_point(const std::vector<SimilarityMatch>& matches) {
  std::vector<MatchesOfPoint> points;
  for (const SimilarityMatch& m : matches) {
    const bool is_same = !points.empty() && points.back().front().in_a.x == m.in_a.x &&
                         points.back().front().in_b.x == m.in_b.x;
    if (!is_same) points.emplace_back();
    points.back().push_back(m);
  }
  return points;
}

// Uncertainty from the scatter of the gradients per point (Huber 1967): all observations of a point, in both
// directions, share its depth error. At least the uncertainty for independent errors.
Uncertainty by_gradients(const std::vector<MatchesOfPoint>& points, double threshold, double sigma,
                         const Sim3& b_from_a) {
  SimilarityInformation information = SimilarityInformation::Zero(), scatter = SimilarityInformation::Zero();
  for (const MatchesOfPoint& observations : points) {
    const SimilarityEquations equations = ByDepths{observations, threshold, sigma}.linearize(b_from_a);
    information += equations.information;
    scatter += equations.gradient * equations.gradient.transpose();
  }
  const SimilarityInformation inverse = inverse_of(information);
  // A point constrains three of the seven parameters.
  const double told = 3.0 * static_cast<double>(points.size());
  return greater(uncertainty_of(sigma * sigma * inverse),
                 uncertainty_of(told / (told - kSimilarityParameters) * inverse * scatter * inverse));
}

}  // namespace

SimilarityReport refine_similarity_by_depths(const std::vector<SimilarityMatch>& matches,
                                             const SimilarityOptions& options, const Sim3& start) {
  require_options(options);
  const UsableMatches usable(matches);
  const ByDepths problem = {usable.data, options.ransac.threshold,
                            options.ransac.threshold / options.threshold_sigmas};
  const double limit = problem.threshold * problem.threshold;
  SimilarityReport report;
  report.inliers.assign(matches.size(), 0);
  report.b_from_a = start;
  report.score = levenberg_marquardt(problem, {options.max_iterations, 1e-9, 0}, &report.b_from_a) +
                 static_cast<double>(usable.all - usable.data.size()) * limit;
  const Sim3 a_from_b = report.b_from_a.inverse();
  std::vector<SimilarityMatch> inliers;
  for (std::size_t i = 0; i < usable.data.size(); ++i) {
    const BothErrors e = problem.errors(usable.data[i], report.b_from_a, a_from_b);
    if (!(e.in_a.squared() < limit && e.in_b.squared() < limit)) continue;
    report.inliers[usable.source[i]] = 1;
    inliers.push_back(usable.data[i]);
  }
  report.num_inliers = static_cast<int>(inliers.size());
  const std::vector<MatchesOfPoint> points = by_point(inliers);
  // Fewer gradients leave their scatter singular.
  if (points.size() <= std::size_t{kSimilarityParameters}) return report;
  std::vector<SimilarityMatch> once;
  for (const MatchesOfPoint& observations : points) once.push_back(observations.front());
  judge(greater(by_gradients(points, problem.threshold, problem.sigma, report.b_from_a),
                by_points(once, report.b_from_a)),
        options, &report);
  return report;
}

}  // namespace mono_pose_tracker
