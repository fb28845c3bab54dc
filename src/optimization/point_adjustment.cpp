#include "optimization/point_adjustment.h"

#include <Eigen/Dense>
#include <algorithm>

#include "reprojection.h"

namespace mono_pose_tracker {

namespace {

// The first steps use reweighted least squares, which is exact for a displaced point. Later steps use the
// curvature of the loss along the residuals, at least this ratio of it: the remaining errors are noise, for
// which reweighted steps are too short by a third.
constexpr int kReweightedSteps = 2;
constexpr double kMinCurvatureRatio = 0.3;

// Ends the search: a step would lower the cost by less than this share of the squared loss width (two sigmas
// squared, by default). It would move the point by 1 % of its standard deviation.
constexpr double kTolerance = 1e-5;

struct Camera {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

struct ViewingRay {
  int camera;
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 2, 3> weighted;
};

class PointSolver {
 public:
  PointSolver(const BundleOptions& options, const std::vector<Camera>& cameras)
      : options_(options), loss_(options.loss_width), cameras_(cameras) {
    tolerance_ = kTolerance * (loss_.is_robust() ? options.loss_width * options.loss_width : 4);
  }

  // Moves a point to the minimum of its cost. Returns the number of steps.
  int solve(const std::vector<ViewingRay>& rays, Eigen::Vector3d* x, double* initial_cost,
            double* final_cost) const {
    double cost = cost_of(rays, *x);
    *initial_cost = cost;
    double damping = 1e-6;
    int step = 0;
    for (; step < options_.max_iterations; ++step) {
      Eigen::Matrix3d information;
      Eigen::Vector3d gradient;
      linearize(rays, *x, step < kReweightedSteps ? 1 : kMinCurvatureRatio, &information, &gradient);
      information.diagonal() += damping * information.diagonal();
      const Eigen::Vector3d shift = -information.ldlt().solve(gradient);
      if (!shift.allFinite() || -gradient.dot(shift) < 2 * tolerance_) break;
      const Eigen::Vector3d candidate = *x + shift;
      const double candidate_cost = cost_of(rays, candidate);
      if (candidate_cost < cost) {
        *x = candidate;
        cost = candidate_cost;
        damping = std::max(1e-9, 0.1 * damping);
      } else {
        damping = std::max(1e-3, 10 * damping);
      }
    }
    *final_cost = cost;
    return step;
  }

 private:
  Reprojection reproject(const ViewingRay& ray, const Eigen::Vector3d& x) const {
    const Camera& camera = cameras_[ray.camera];
    return {ray.bearing, ray.weighted, camera.rotation * x + camera.translation};
  }

  double cost_of(const std::vector<ViewingRay>& rays, const Eigen::Vector3d& x) const {
    double cost = 0;
    for (const ViewingRay& s : rays) cost += 0.5 * loss_.cost(reproject(s, x).residual.squaredNorm());
    return cost;
  }

  void linearize(const std::vector<ViewingRay>& rays, const Eigen::Vector3d& x, double min_curvature_ratio,
                 Eigen::Matrix3d* information, Eigen::Vector3d* gradient) const {
    information->setZero();
    gradient->setZero();
    for (const ViewingRay& ray : rays) {
      const Reprojection p = reproject(ray, x);
      if (!p.in_front) continue;
      const double s = p.residual.squaredNorm(), derivative = loss_.derivative(s);
      const Eigen::Matrix<double, 2, 3> j = p.by_point * cameras_[ray.camera].rotation;
      const Eigen::Vector3d along = j.transpose() * p.residual;
      *gradient += derivative * along;
      *information += derivative * (j.transpose() * j);
      if (s > 0)
        *information -= derivative * (1 - loss_.curvature_ratio(s, min_curvature_ratio)) / s *
                        (along * along.transpose());
    }
  }

  const BundleOptions& options_;
  const Loss loss_;
  const std::vector<Camera>& cameras_;
  double tolerance_;
};

// Observations sorted by point: those of point p are order[begin[p]] up to order[begin[p + 1]].
struct ByPoint {
  std::vector<int> begin, order;

  explicit ByPoint(const BundleProblem& problem) : begin(problem.points.size() + 2, 0) {
    for (const BundleObservation& o : problem.observations) ++begin[o.point + 2];
    for (std::size_t p = 2; p < begin.size(); ++p) begin[p] += begin[p - 1];
    order.resize(problem.observations.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      order[begin[problem.observations[i].point + 1]++] = static_cast<int>(i);
  }
};

}  // namespace

BundleReport adjust_points(const BundleOptions& options, BundleProblem* problem) {
  options.validate();
  BundleReport report;
  std::vector<Camera> cameras;
  for (const BundleCamera& c : problem->cameras)
    cameras.push_back({c.camera_from_map.rotation_matrix(), c.camera_from_map.translation});
  const PointSolver solver(options, cameras);
  const ByPoint by_point(*problem);
  std::vector<ViewingRay> rays;
  for (std::size_t p = 0; p < problem->points.size(); ++p) {
    rays.clear();
    for (int i = by_point.begin[p]; i < by_point.begin[p + 1]; ++i) {
      const BundleObservation& o = problem->observations[by_point.order[i]];
      const Camera& camera = cameras[o.camera];
      const double along = o.bearing.dot(camera.rotation * problem->points[p] + camera.translation);
      if (is_usable(o) && along > 0) rays.push_back({o.camera, o.bearing, o.pixel_from_bearing / o.sigma_px});
    }
    if (rays.size() < 2) continue;
    report.usable = true;
    double initial = 0, final = 0;
    report.iterations =
        std::max(report.iterations, solver.solve(rays, &problem->points[p], &initial, &final));
    report.initial_cost += initial;
    report.final_cost += final;
  }
  return report;
}

}  // namespace mono_pose_tracker
