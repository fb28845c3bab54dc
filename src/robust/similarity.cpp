#include "robust/similarity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "levenberg_marquardt.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "robust/ransac.h"
#include "robust/sampler.h"
#include "similarity_certainty.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

namespace {

constexpr int kLocalIterations = 5;   // of a model just sampled
constexpr int kFinalIterations = 20;  // of the result; quadratic convergence ends it after a few

// Smallest height of a sampled triangle over its longest side. In a flatter one the rotation about that side
// is dominated by noise.
constexpr double kMinHeight = 0.05;

bool is_triangle(const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d side = corners.col(1) - corners.col(0), other = corners.col(2) - corners.col(0);
  const double longest = std::max({side.norm(), other.norm(), (side - other).norm()});
  return side.cross(other).norm() > kMinHeight * longest * longest;
}

// Squared sine of the angle between a viewing ray and a point; 1 behind the camera.
double squared_angle(const ObservedPoint& observation, const Eigen::Vector3d& x) {
  const Eigen::Vector3d p = x - observation.center;
  if (!(p.dot(observation.bearing) > 0)) return 1;
  return observation.bearing.cross(p).squaredNorm() / p.squaredNorm();
}

// Weight that converts an error of log depth to an equally unlikely angle; 0 if the depth is unknown.
double depth_weight(const SimilarityMatch& match, double threshold) {
  return threshold / SimilarityOptions::kThresholdSigmas / match.depth_sigma();
}

// Logarithm of the depth ratio between the other map's point and the own one.
double log_depth_ratio(const ObservedPoint& observation, const Eigen::Vector3d& x) {
  return 0.5 * std::log((x - observation.center).squaredNorm() /
                        (observation.x - observation.center).squaredNorm());
}

double squared_error(const ObservedPoint& observation, const Eigen::Vector3d& x, double weight) {
  const double angle = squared_angle(observation, x);
  if (weight == 0) return angle;
  const double depth = weight * log_depth_ratio(observation, x);
  return angle + depth * depth;
}

struct Errors {
  double in_a, in_b;  // squared, as angles
};

Errors errors_of(const SimilarityMatch& match, const Sim3& b_from_a, const Sim3& a_from_b, double threshold) {
  const double weight = depth_weight(match, threshold);
  return {squared_error(match.in_a, a_from_b * match.in_b.x, weight),
          squared_error(match.in_b, b_from_a * match.in_a.x, weight)};
}

RansacScore score_similarity(const std::vector<SimilarityMatch>& matches, const Sim3& b_from_a,
                             double threshold, double cost_bound, std::vector<char>* inliers = nullptr) {
  const Sim3 a_from_b = b_from_a.inverse();
  const double limit = threshold * threshold;
  RansacScore score;
  score.cost = 0;
  if (inliers) inliers->assign(matches.size(), 0);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Errors e = errors_of(matches[i], b_from_a, a_from_b, threshold);
    score.cost += 0.5 * (std::min(e.in_a, limit) + std::min(e.in_b, limit));
    const bool inlier = e.in_a < limit && e.in_b < limit;
    score.num_inliers += inlier;
    if (inliers) (*inliers)[i] = inlier;
    if (score.cost >= cost_bound) return RansacScore();
  }
  return score;
}

struct ObservationEquations : NormalEquations<kSimilarityParameters> {
  double squares = 0;
  int residuals = 0;

  // Residuals: u - bearing for the direction u from the camera to x (nearly the angle between them), and the
  // log depth ratio. dx: derivative of x by the step.
  void add(const ObservedPoint& observation, const Eigen::Vector3d& x, const PointDerivative& dx,
           double depth_weight) {
    const Eigen::Vector3d p = x - observation.center;
    const double distance = p.norm();
    const Eigen::Vector3d u = p / distance, e = u - observation.bearing;
    const PointDerivative j = (dx - u * (u.transpose() * dx)) / distance;
    information += j.transpose() * j;
    gradient += j.transpose() * e;
    squares += e.squaredNorm();
    residuals += 2;
    if (depth_weight == 0) return;
    const double depth = depth_weight * log_depth_ratio(observation, x);
    const SimilarityStep of_depth = depth_weight / distance * (u.transpose() * dx).transpose();
    information += of_depth * of_depth.transpose();
    gradient += of_depth * depth;
    squares += depth * depth;
    ++residuals;
  }
};

// Gradient of the truncated cost: each side of a match counts if it is within the threshold.
ObservationEquations linearize(const std::vector<SimilarityMatch>& matches, const Sim3& b_from_a,
                               double threshold) {
  const Sim3 a_from_b = b_from_a.inverse();
  const Eigen::Matrix3d turn_to_a = a_from_b.scale * a_from_b.rotation.toRotationMatrix();
  const double limit = threshold * threshold;
  ObservationEquations equations;
  for (const SimilarityMatch& m : matches) {
    const Errors e = errors_of(m, b_from_a, a_from_b, threshold);
    const double weight = depth_weight(m, threshold);
    if (e.in_b < limit) {
      const Eigen::Vector3d x = b_from_a * m.in_a.x;
      equations.add(m.in_b, x, step_jacobian(x), weight);
    }
    // The inverse takes the step back from the point in b before it takes the point to a.
    if (e.in_a < limit)
      equations.add(m.in_a, a_from_b * m.in_b.x, -turn_to_a * step_jacobian(m.in_b.x), weight);
  }
  return equations;
}

struct SimilarityProblem {
  const std::vector<SimilarityMatch>& matches;
  double threshold;

  double cost(const Sim3& b_from_a) const {
    return score_similarity(matches, b_from_a, threshold, std::numeric_limits<double>::infinity()).cost;
  }
  ObservationEquations linearize(const Sim3& b_from_a) const {
    return mono_pose_tracker::linearize(matches, b_from_a, threshold);
  }
  Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) const {
    return mono_pose_tracker::stepped(b_from_a, step);
  }
};

void refine(const std::vector<SimilarityMatch>& matches, double threshold, int max_iterations,
            Sim3* b_from_a) {
  levenberg_marquardt(SimilarityProblem{matches, threshold}, {max_iterations, 1e-9, 0}, b_from_a);
}

class SimilarityEstimator {
 public:
  using Model = Sim3;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 1;

  SimilarityEstimator(const std::vector<SimilarityMatch>& matches, double threshold)
      : matches_(matches), threshold_(threshold) {}

  int num_data() const { return static_cast<int>(matches_.size()); }

  int solve(const std::array<int, 3>& sample, std::array<Sim3, 1>* models) const {
    Eigen::Matrix3d a, b;
    for (int k = 0; k < 3; ++k) {
      a.col(k) = matches_[sample[k]].in_a.x;
      b.col(k) = matches_[sample[k]].in_b.x;
    }
    if (!is_triangle(a) || !is_triangle(b)) return 0;
    return align_sim3(a, b, &models->front()) ? 1 : 0;
  }

  RansacScore score(const Sim3& b_from_a, double cost_bound) const {
    return score_similarity(matches_, b_from_a, threshold_, cost_bound);
  }

  void optimize(Sim3* b_from_a) const { refine(matches_, threshold_, kLocalIterations, b_from_a); }

  bool is_equivalent(const Sim3&, const Sim3&) const { return false; }

 private:
  const std::vector<SimilarityMatch>& matches_;
  double threshold_;
};

// Uncertainty from the angles, with the points assumed exact. The noise is estimated from the inliers; with
// too few inliers half the threshold is used.
Uncertainty by_residuals(const ObservationEquations& equations, double threshold) {
  const int redundancy = equations.residuals - kSimilarityParameters;
  const double variance =
      redundancy > 2 * kSimilarityParameters ? equations.squares / redundancy : 0.25 * threshold * threshold;
  return uncertainty_of(variance * inverse_of(equations.information));
}

ObservedPoint observation_of(const RayToPoint& ray) {
  ObservedPoint observation;
  observation.center = ray.center;
  observation.bearing = ray.bearing;
  return observation;
}

double squared_error(const RayToPoint& ray, const Sim3& b_from_a, const Sim3& a_from_b) {
  return squared_angle(observation_of(ray), (ray.is_of_a ? a_from_b : b_from_a) * ray.x);
}

struct RayProblem {
  const std::vector<RayToPoint>& rays;
  double threshold;

  RansacScore score(const Sim3& b_from_a, std::vector<char>* inliers = nullptr) const {
    const Sim3 a_from_b = b_from_a.inverse();
    const double limit = threshold * threshold;
    RansacScore score;
    score.cost = 0;
    if (inliers) inliers->assign(rays.size(), 0);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double error = squared_error(rays[i], b_from_a, a_from_b);
      score.cost += std::min(error, limit);
      score.num_inliers += error < limit;
      if (inliers) (*inliers)[i] = error < limit;
    }
    return score;
  }
  double cost(const Sim3& b_from_a) const { return score(b_from_a).cost; }
  ObservationEquations linearize(const Sim3& b_from_a) const {
    const Sim3 a_from_b = b_from_a.inverse();
    const Eigen::Matrix3d turn_to_a = a_from_b.scale * a_from_b.rotation.toRotationMatrix();
    ObservationEquations equations;
    for (const RayToPoint& ray : rays) {
      if (squared_error(ray, b_from_a, a_from_b) >= threshold * threshold) continue;
      if (ray.is_of_a) {
        equations.add(observation_of(ray), a_from_b * ray.x, -turn_to_a * step_jacobian(ray.x), 0);
      } else {
        const Eigen::Vector3d x = b_from_a * ray.x;
        equations.add(observation_of(ray), x, step_jacobian(x), 0);
      }
    }
    return equations;
  }
  Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) const {
    return mono_pose_tracker::stepped(b_from_a, step);
  }
};

// The pose of a camera in the other map determines own_from_other except for its scale, which follows from
// one ray of another camera. camera_from_other: with the axes of the own map; center: of the camera, in the
// own map. None where the scale is not positive.
std::optional<Sim3> with_scale_of(const RayToPoint& ray, bool is_of_own, const Rigid3& camera_from_other,
                                  const Eigen::Vector3d& center) {
  const Eigen::Matrix3d turn = camera_from_other.rotation_matrix();
  // scale * far + near is along the ray's direction.
  Eigen::Vector3d far, near, direction;
  if (is_of_own) {
    far = camera_from_other * ray.x;
    near = center - ray.center;
    direction = ray.bearing;
  } else {
    far = ray.x - center;
    near = -(camera_from_other * ray.center);
    direction = turn * ray.bearing;
  }
  const Eigen::Vector3d across = far.cross(direction);
  double scale = -near.cross(direction).dot(across) / across.squaredNorm();
  if (!is_of_own) scale = 1 / scale;
  if (!std::isfinite(scale) || scale <= 0) return std::nullopt;
  return Sim3(scale, camera_from_other.rotation, center + scale * camera_from_other.translation);
}

// The similarity of the lowest cost among those from the pose of one camera and the scale of one ray.
// inliers: the sum over the cameras, each with its own pose.
std::optional<Sim3> best_by_cameras(const RayProblem& problem, const RansacOptions& ransac, int* inliers) {
  constexpr std::size_t kScales = 50;  // tried for each camera
  std::map<std::pair<bool, int>, std::vector<std::size_t>> of_camera;
  for (std::size_t i = 0; i < problem.rays.size(); ++i)
    of_camera[{problem.rays[i].is_of_a, problem.rays[i].camera}].push_back(i);
  std::optional<Sim3> best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (const auto& [camera, own] : of_camera) {
    std::vector<Eigen::Vector3d> bearings, points;
    for (const std::size_t i : own) {
      bearings.push_back(problem.rays[i].bearing);
      points.push_back(problem.rays[i].x);
    }
    AbsolutePoseOptions options;
    options.ransac = ransac;
    const AbsolutePoseReport pose = estimate_absolute_pose(bearings, points, options);
    if (!pose.success) continue;
    *inliers += pose.num_inliers;
    const std::size_t step = 1 + problem.rays.size() / kScales;
    for (std::size_t i = 0; i < problem.rays.size(); i += step) {
      const RayToPoint& ray = problem.rays[i];
      if (ray.is_of_a == camera.first && ray.camera == camera.second) continue;
      const std::optional<Sim3> own_from_other = with_scale_of(
          ray, ray.is_of_a == camera.first, pose.camera_from_map, problem.rays[own.front()].center);
      if (!own_from_other) continue;
      const Sim3 b_from_a = camera.first ? own_from_other->inverse() : *own_from_other;
      const double cost = problem.cost(b_from_a);
      if (cost < best_cost) best_cost = cost, best = b_from_a;
    }
  }
  return best;
}

// Least squares from this start.
SimilarityReport report_from(const UsableMatches& matches, const SimilarityOptions& options,
                             const Sim3& start) {
  const std::vector<SimilarityMatch>& data = matches.data;
  const double threshold = options.ransac.threshold;
  SimilarityReport report;
  report.inliers.assign(matches.all, 0);
  report.b_from_a = start;
  refine(data, threshold, kFinalIterations, &report.b_from_a);
  std::vector<char> flags;
  const RansacScore score =
      score_similarity(data, report.b_from_a, threshold, std::numeric_limits<double>::infinity(), &flags);
  std::vector<SimilarityMatch> inliers;
  for (std::size_t i = 0; i < data.size(); ++i) {
    report.inliers[matches.source[i]] = flags[i];
    if (flags[i]) inliers.push_back(data[i]);
  }
  report.score = score.cost + (matches.all - data.size()) * threshold * threshold;
  report.num_inliers = score.num_inliers;
  // Three matches fit some similarity nearly always: only a fourth says anything.
  if (score.num_inliers <= SimilarityEstimator::kSampleSize) return report;
  judge(greater(by_residuals(linearize(inliers, report.b_from_a, threshold), threshold),
                by_points(inliers, report.b_from_a)),
        options, &report);
  return report;
}

}  // namespace

SimilarityReport estimate_similarity(const std::vector<SimilarityMatch>& matches,
                                     const SimilarityOptions& options) {
  require_options(options);
  const UsableMatches usable(matches);
  SimilarityReport none;
  none.inliers.assign(matches.size(), 0);
  if (usable.data.size() < SimilarityEstimator::kSampleSize) return none;
  SimilarityEstimator estimator(usable.data, options.ransac.threshold);
  UniformSampler sampler(estimator.num_data(), SimilarityEstimator::kSampleSize);
  RansacReport<Sim3> sampled = ransac(options.ransac, estimator, sampler);
  none.iterations = sampled.iterations;
  if (sampled.best.score.num_inliers <= SimilarityEstimator::kSampleSize) return none;
  SimilarityReport report = report_from(usable, options, sampled.best.model);
  report.iterations = sampled.iterations;
  return report;
}

SimilarityReport estimate_similarity_from_rays(const std::vector<RayToPoint>& rays,
                                               const SimilarityOptions& options) {
  require_options(options);
  SimilarityReport report;
  report.inliers.assign(rays.size(), 0);
  const RayProblem problem{rays, options.ransac.threshold};
  int inliers_one_by_one = 0;
  const std::optional<Sim3> start = best_by_cameras(problem, options.ransac, &inliers_one_by_one);
  if (!start) return report;
  report.b_from_a = *start;
  levenberg_marquardt(problem, {kFinalIterations, 1e-9, 0}, &report.b_from_a);
  const RansacScore score = problem.score(report.b_from_a, &report.inliers);
  report.score = score.cost;
  report.num_inliers = score.num_inliers;
  const ObservationEquations equations = problem.linearize(report.b_from_a);
  // Four rays of two residuals each determine a similarity. Cameras that do not agree on one are no evidence
  // for it.
  if (equations.residuals <= kSimilarityParameters + 1 || 2 * report.num_inliers < inliers_one_by_one)
    return report;
  judge(by_residuals(equations, options.ransac.threshold), options, &report);
  return report;
}

SimilarityReport refine_similarity(const std::vector<SimilarityMatch>& matches,
                                   const SimilarityOptions& options, const Sim3& start) {
  require_options(options);
  return report_from(UsableMatches(matches), options, start);
}

}  // namespace mono_pose_tracker
