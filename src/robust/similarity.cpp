#include "robust/similarity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "levenberg_marquardt.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "robust/ransac.h"
#include "similarity_certainty.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

namespace {

struct RayEquations : NormalEquations<kSimilarityParameters> {
  double squares = 0;
  int residuals = 0;

  // Residual: u - bearing for the direction u from the camera to x (nearly the angle between them). dx:
  // derivative of x by the step.
  void add(const RayToPoint& ray, const Eigen::Vector3d& x, const PointDerivative& dx) {
    const Eigen::Vector3d p = x - ray.center;
    const double distance = p.norm();
    const Eigen::Vector3d u = p / distance, e = u - ray.bearing;
    const PointDerivative j = (dx - u * (u.transpose() * dx)) / distance;
    information += j.transpose() * j;
    gradient += j.transpose() * e;
    squares += e.squaredNorm();
    residuals += 2;
  }
};

// Squared sine of the angle between the ray and its point; 1 behind the camera.
double squared_error(const RayToPoint& ray, const Sim3& b_from_a, const Sim3& a_from_b) {
  const Eigen::Vector3d p = (ray.is_of_a ? a_from_b : b_from_a) * ray.x - ray.center;
  if (!(p.dot(ray.bearing) > 0)) return 1;
  return ray.bearing.cross(p).squaredNorm() / p.squaredNorm();
}

struct RayProblem {
  const std::vector<RayToPoint>& rays;
  double threshold;

  RansacScore score(const Sim3& b_from_a, double cost_bound = std::numeric_limits<double>::infinity(),
                    std::vector<char>* inliers = nullptr) const {
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
      if (score.cost >= cost_bound) return RansacScore();
    }
    return score;
  }
  double cost(const Sim3& b_from_a) const { return score(b_from_a).cost; }
  RayEquations linearize(const Sim3& b_from_a) const {
    const Sim3 a_from_b = b_from_a.inverse();
    const Eigen::Matrix3d turn_to_a = a_from_b.scale * a_from_b.rotation.toRotationMatrix();
    RayEquations equations;
    for (const RayToPoint& ray : rays) {
      if (squared_error(ray, b_from_a, a_from_b) >= threshold * threshold) continue;
      if (ray.is_of_a) {
        // The inverse takes the step back from the point in b before it takes the point to a.
        equations.add(ray, a_from_b * ray.x, -turn_to_a * step_jacobian(ray.x));
      } else {
        const Eigen::Vector3d x = b_from_a * ray.x;
        equations.add(ray, x, step_jacobian(x));
      }
    }
    return equations;
  }
  Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) const {
    return mono_pose_tracker::stepped(b_from_a, step);
  }
};

// With the points assumed exact. Noise is estimated from the inliers; with too few inliers half the threshold
// is used.
Uncertainty by_residuals(const RayEquations& equations, double threshold) {
  const int redundancy = equations.residuals - kSimilarityParameters;
  const double variance =
      redundancy > 2 * kSimilarityParameters ? equations.squares / redundancy : 0.25 * threshold * threshold;
  return uncertainty_of(variance * inverse_of(equations.information));
}

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

// The rays of at most so many cameras of each map, those that have most.
std::vector<std::vector<RayToPoint>> by_camera(const std::vector<RayToPoint>& rays, std::size_t most) {
  std::map<std::pair<bool, int>, std::vector<RayToPoint>> all;
  for (const RayToPoint& ray : rays) all[{ray.is_of_a, ray.camera}].push_back(ray);
  std::array<std::vector<std::vector<RayToPoint>>, 2> of_map;
  for (auto& [camera, own] : all) of_map[camera.first].push_back(std::move(own));
  std::vector<std::vector<RayToPoint>> chosen;
  for (auto& cameras : of_map) {
    std::stable_sort(cameras.begin(), cameras.end(),
                     [](const auto& one, const auto& other) { return one.size() > other.size(); });
    if (cameras.size() > most) cameras.resize(most);
    std::move(cameras.begin(), cameras.end(), std::back_inserter(chosen));
  }
  return chosen;
}

// The similarity of the lowest cost among those from the pose of one camera and the scale of one ray of
// another. inliers: the sum over the cameras, each with its own pose.
std::optional<Sim3> best_by_cameras(const std::vector<std::vector<RayToPoint>>& cameras,
                                    const RayProblem& problem, const SimilarityOptions& options,
                                    int* inliers) {
  std::optional<Sim3> best;
  double best_cost = std::numeric_limits<double>::infinity();
  const std::size_t step = 1 + problem.rays.size() / options.max_scales;
  for (const std::vector<RayToPoint>& own : cameras) {
    std::vector<Eigen::Vector3d> bearings, points;
    for (const RayToPoint& ray : own) {
      bearings.push_back(ray.bearing);
      points.push_back(ray.x);
    }
    const AbsolutePoseReport pose =
        estimate_absolute_pose(bearings, points, AbsolutePoseOptions::in_growing_map(options.ransac));
    if (!pose.success) continue;
    *inliers += pose.num_inliers;
    for (std::size_t i = 0; i < problem.rays.size(); i += step) {
      const RayToPoint& ray = problem.rays[i];
      const bool is_of_own = ray.is_of_a == own.front().is_of_a;
      if (is_of_own && ray.camera == own.front().camera) continue;
      const std::optional<Sim3> own_from_other =
          with_scale_of(ray, is_of_own, pose.camera_from_map, own.front().center);
      if (!own_from_other) continue;
      const Sim3 b_from_a = own.front().is_of_a ? own_from_other->inverse() : *own_from_other;
      const double cost = problem.score(b_from_a, best_cost).cost;
      if (cost < best_cost) best_cost = cost, best = b_from_a;
    }
  }
  return best;
}

}  // namespace

SimilarityReport estimate_similarity_from_rays(const std::vector<RayToPoint>& rays,
                                               const SimilarityOptions& options) {
  require_options(options);
  SimilarityReport report;
  report.inliers.assign(rays.size(), 0);
  const std::vector<std::vector<RayToPoint>> cameras = by_camera(rays, options.max_cameras);
  std::vector<RayToPoint> of_cameras;
  for (const auto& own : cameras) of_cameras.insert(of_cameras.end(), own.begin(), own.end());
  const RayProblem problem{rays, options.ransac.threshold}, few{of_cameras, options.ransac.threshold};
  int inliers_one_by_one = 0;
  const std::optional<Sim3> start = best_by_cameras(cameras, few, options, &inliers_one_by_one);
  if (!start) return report;
  report.b_from_a = *start;
  levenberg_marquardt(problem, {options.max_iterations, 1e-9, 0}, &report.b_from_a);
  const RansacScore score =
      problem.score(report.b_from_a, std::numeric_limits<double>::infinity(), &report.inliers);
  report.score = score.cost;
  report.num_inliers = score.num_inliers;
  const RayEquations equations = problem.linearize(report.b_from_a);
  // Four rays of two residuals each determine a similarity. Cameras that do not agree on one are no evidence
  // for it.
  if (equations.residuals <= kSimilarityParameters + 1 ||
      2 * few.score(report.b_from_a).num_inliers < inliers_one_by_one)
    return report;
  judge(by_residuals(equations, options.ransac.threshold), options, &report);
  return report;
}

}  // namespace mono_pose_tracker
