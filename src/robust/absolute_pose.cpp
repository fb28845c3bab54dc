#include "mono_pose_tracker/robust/absolute_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "mono_pose_tracker/geometry/p3p.h"
#include "mono_pose_tracker/robust/ransac.h"
#include "mono_pose_tracker/robust/sampler.h"

namespace mono_pose_tracker {

namespace {

constexpr int kLocalIterations = 5;   // of a model just sampled
constexpr int kFinalIterations = 20;  // of the result; quadratic convergence ends it after a few

// sin^2 of the angle between a unit bearing and the direction to a point in the camera's frame; 1 behind the
// camera.
double squared_angle(const Eigen::Vector3d& p, const Eigen::Vector3d& bearing) {
  return p.dot(bearing) > 0 ? p.cross(bearing).squaredNorm() / p.squaredNorm() : 1.0;
}

struct Match {
  Eigen::Vector3d bearing;
  Eigen::Vector3d point;
  int source;  // index in the caller's vectors
};

struct PoseModel {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // camera_from_map
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

class PoseEstimator {
 public:
  using Model = PoseModel;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 4;

  PoseEstimator(const std::vector<Match>& matches, double threshold)
      : matches_(matches), squared_threshold_(threshold * threshold) {}

  int num_data() const { return static_cast<int>(matches_.size()); }

  int solve(const std::array<int, 3>& sample, std::array<PoseModel, 4>* models) const {
    std::array<Eigen::Vector3d, 3> bearings, points;
    for (int k = 0; k < 3; ++k) {
      bearings[k] = matches_[sample[k]].bearing;
      points[k] = matches_[sample[k]].point;
    }
    std::array<Rigid3, 4> poses;
    const int count = p3p(bearings, points, &poses);
    for (int k = 0; k < count; ++k) {
      (*models)[k] = {poses[k].rotation_matrix(), poses[k].translation};
    }
    return count;
  }

  RansacScore score(const PoseModel& model, double cost_bound) const {
    RansacScore score;
    score.cost = 0;
    for (const Match& match : matches_) {
      const double squared = squared_angle(model.rotation * match.point + model.translation, match.bearing);
      if (squared < squared_threshold_) {
        score.cost += squared;
        ++score.num_inliers;
      } else {
        score.cost += squared_threshold_;
        if (score.cost >= cost_bound) {
          break;
        }
      }
    }
    return score;
  }

  void optimize(PoseModel* model) const { refine(kLocalIterations, model); }

  bool alike(const PoseModel&, const PoseModel&) const { return false; }

  // Levenberg-Marquardt over the truncated squared angles; matches beyond the threshold have no say in a
  // step.
  void refine(int max_iterations, PoseModel* model) const;

 private:
  struct NormalEquations {
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  };
  NormalEquations linearize(const PoseModel& model) const;

  const std::vector<Match>& matches_;
  double squared_threshold_;
};

// Residual u - b for the direction u to the point, nearly the angle between them; the perturbation is x' =
// exp(w) x + v in the camera's frame, order v, w. With J of u: J^T J has the blocks (I - u u^T) / |p|^2,
// -[u]x / |p| and I - u u^T.
PoseEstimator::NormalEquations PoseEstimator::linearize(const PoseModel& model) const {
  NormalEquations sum;
  for (const Match& match : matches_) {
    const Eigen::Vector3d p = model.rotation * match.point + model.translation;
    if (!(squared_angle(p, match.bearing) < squared_threshold_)) {
      continue;
    }
    const double inverse = 1 / p.norm();
    const Eigen::Vector3d u = p * inverse;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - u * u.transpose();
    Eigen::Matrix3d cross;
    cross << 0, -u.z(), u.y(), u.z(), 0, -u.x(), -u.y(), u.x(), 0;
    sum.information.topLeftCorner<3, 3>() += (inverse * inverse) * across;
    sum.information.bottomLeftCorner<3, 3>() += inverse * cross;
    sum.information.bottomRightCorner<3, 3>() += across;
    sum.gradient.head<3>() -= inverse * (across * match.bearing);
    sum.gradient.tail<3>() -= u.cross(match.bearing);
  }
  return sum;
}

void PoseEstimator::refine(int max_iterations, PoseModel* model) const {
  double cost = score(*model, std::numeric_limits<double>::infinity()).cost;
  double damping = 1e-4;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const NormalEquations equations = linearize(*model);
    const double previous = cost;
    while (damping < 1e6) {
      Eigen::Matrix<double, 6, 6> damped = equations.information;
      damped.diagonal() *= 1 + damping;
      const Eigen::Matrix<double, 6, 1> step =
          -damped.selfadjointView<Eigen::Lower>().ldlt().solve(equations.gradient);
      const Eigen::Vector3d w = step.tail<3>();
      const double angle = w.norm();
      const Eigen::Matrix3d turn = angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                                             : Eigen::Matrix3d::Identity().eval();
      const PoseModel candidate{turn * model->rotation, turn * model->translation + step.head<3>()};
      const double candidate_cost = score(candidate, std::numeric_limits<double>::infinity()).cost;
      if (candidate_cost < cost) {
        *model = candidate;
        cost = candidate_cost;
        damping = std::max(1e-9, damping * 0.1);
        break;
      }
      damping *= 10;
    }
    if (!(previous - cost > 1e-6 * cost)) {
      break;  // less than the sixth digit of the cost moves the pose far below its uncertainty
    }
  }
}

void validate(const std::vector<Eigen::Vector3d>& bearings, const std::vector<Eigen::Vector3d>& points,
              const AbsolutePoseOptions& options) {
  options.ransac.validate();
  if (bearings.size() != points.size()) {
    throw std::invalid_argument("estimate_absolute_pose: " + std::to_string(bearings.size()) +
                                " bearings match " + std::to_string(points.size()) + " points");
  }
  if (!options.quality.empty() && options.quality.size() != points.size()) {
    throw std::invalid_argument("AbsolutePoseOptions: quality has " + std::to_string(options.quality.size()) +
                                " values for " + std::to_string(points.size()) + " matches");
  }
}

// The matches that are finite, in a seeded random order: the first few are then a fair sample for scoring.
std::vector<Match> finite_matches(const std::vector<Eigen::Vector3d>& bearings,
                                  const std::vector<Eigen::Vector3d>& points, std::uint64_t seed) {
  std::vector<Match> matches;
  matches.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double norm = bearings[i].norm();
    if (points[i].allFinite() && std::isfinite(norm) && norm > 0) {
      matches.push_back({bearings[i] / norm, points[i], static_cast<int>(i)});
    }
  }
  Random random(seed);
  for (std::size_t i = matches.size(); i > 1; --i) {
    std::swap(matches[i - 1], matches[random.index(static_cast<std::uint32_t>(i))]);
  }
  return matches;
}

RansacReport<PoseModel> sample_consensus(const std::vector<Match>& matches,
                                         const AbsolutePoseOptions& options, PoseEstimator& estimator) {
  if (options.quality.empty()) {
    UniformSampler sampler(estimator.num_data(), PoseEstimator::kSampleSize);
    return ransac(options.ransac, estimator, sampler);
  }
  std::vector<float> quality;
  quality.reserve(matches.size());
  for (const Match& match : matches) {
    quality.push_back(options.quality[match.source]);
  }
  ProsacSampler sampler(quality, PoseEstimator::kSampleSize);
  return ransac(options.ransac, estimator, sampler);
}

}  // namespace

AbsolutePoseReport estimate_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                          const std::vector<Eigen::Vector3d>& points_in_map,
                                          const AbsolutePoseOptions& options) {
  validate(bearings_in_camera, points_in_map, options);
  AbsolutePoseReport report;
  report.inliers.assign(points_in_map.size(), 0);
  const double threshold = options.ransac.threshold;
  const std::vector<Match> matches = finite_matches(bearings_in_camera, points_in_map, options.ransac.seed);
  if (matches.size() < PoseEstimator::kSampleSize) {
    return report;
  }
  PoseEstimator estimator(matches, threshold);
  RansacReport<PoseModel> sampled = sample_consensus(matches, options, estimator);
  report.iterations = sampled.iterations;
  // Any three matches fit some pose: only a fourth says anything.
  if (sampled.best.score.num_inliers <= PoseEstimator::kSampleSize) {
    return report;
  }
  PoseModel& model = sampled.best.model;
  estimator.refine(kFinalIterations, &model);
  const RansacScore score = estimator.score(model, std::numeric_limits<double>::infinity());
  report.success = true;
  report.camera_from_map = Rigid3(model.rotation, model.translation);
  report.camera_from_map.rotation.normalize();
  report.score = score.cost + (points_in_map.size() - matches.size()) * threshold * threshold;
  report.num_inliers = score.num_inliers;
  for (const Match& match : matches) {
    const Eigen::Vector3d p = model.rotation * match.point + model.translation;
    report.inliers[match.source] = squared_angle(p, match.bearing) < threshold * threshold;
  }
  return report;
}

}  // namespace mono_pose_tracker
