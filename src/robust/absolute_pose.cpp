#include "mono_pose_tracker/robust/absolute_pose.h"

#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "mono_pose_tracker/geometry/p3p.h"
#include "robust/point_matches.h"
#include "robust/ransac.h"
#include "sample_consensus.h"

namespace mono_pose_tracker {

namespace {

class PoseEstimator {
 public:
  using Model = CameraPose;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 4;

  PoseEstimator(const PointMatches& matches, const AbsolutePoseOptions& options)
      : matches_(matches), options_(options), threshold_(options.ransac.threshold) {}

  int num_data() const { return matches_.size(); }

  int solve(const std::array<int, 3>& sample, std::array<CameraPose, 4>* models) const {
    std::array<Eigen::Vector3d, 3> bearings, points;
    for (int k = 0; k < 3; ++k) {
      bearings[k] = matches_.bearings()[sample[k]];
      points[k] = matches_.points()[sample[k]];
    }
    return p3p(bearings, points, models);
  }

  RansacScore score(const CameraPose& pose, double cost_bound) const {
    return score_camera_pose(matches_, pose, threshold_, cost_bound);
  }

  void optimize(CameraPose* pose) const {
    refine_camera_pose(matches_, threshold_, options_.local_iterations, pose);
  }

  bool is_equivalent(const CameraPose&, const CameraPose&) const { return false; }

 private:
  const PointMatches& matches_;
  const AbsolutePoseOptions& options_;
  double threshold_;
};

void validate(const std::vector<Eigen::Vector3d>& bearings, const std::vector<Eigen::Vector3d>& points,
              const AbsolutePoseOptions& options) {
  options.ransac.validate();
  if (bearings.size() != points.size()) {
    throw std::invalid_argument("estimate_absolute_pose: " + std::to_string(bearings.size()) +
                                " bearings and " + std::to_string(points.size()) +
                                " points, expected equal numbers");
  }
  if (options.local_iterations < 0 || options.final_iterations < 1 || !(options.widening >= 1)) {
    throw std::invalid_argument(
        "AbsolutePoseOptions: local_iterations must be at least 0, final_iterations and widening at least 1");
  }
  require_quality_of_each(options.quality, points.size(), "AbsolutePoseOptions", "matches");
}

}  // namespace

AbsolutePoseReport estimate_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                          const std::vector<Eigen::Vector3d>& points_in_map,
                                          const AbsolutePoseOptions& options) {
  validate(bearings_in_camera, points_in_map, options);
  AbsolutePoseReport report;
  report.inliers.assign(points_in_map.size(), 0);
  const double threshold = options.ransac.threshold;
  const PointMatches matches(bearings_in_camera, points_in_map, options.ransac.seed);
  if (matches.size() < PoseEstimator::kSampleSize) {
    return report;
  }
  PoseEstimator estimator(matches, options);
  RansacReport<CameraPose> sampled = sample_consensus(options.ransac, matches, options.quality, estimator);
  report.iterations = sampled.iterations;
  // Any three matches fit some pose: only a fourth says anything.
  if (sampled.best.score.num_inliers <= PoseEstimator::kSampleSize) {
    return report;
  }
  CameraPose& pose = sampled.best.model;
  refine_camera_pose(matches, threshold, options.final_iterations, &pose);
  if (options.widening > 1)
    widen_camera_pose(matches, threshold, options.widening, options.final_iterations, &pose);
  std::vector<char> inliers;
  const RansacScore score =
      score_camera_pose(matches, pose, threshold, std::numeric_limits<double>::infinity(), &inliers);
  if (options.refined_within_noise) polish_camera_pose(matches, threshold, options.final_iterations, &pose);
  report.success = true;
  report.camera_from_map = Rigid3(pose.rotation, pose.translation);
  report.camera_from_map.rotation.normalize();
  report.score = score.cost + (points_in_map.size() - matches.size()) * threshold * threshold;
  report.num_inliers = score.num_inliers;
  for (int i = 0; i < matches.size(); ++i) {
    report.inliers[matches.source(i)] = inliers[i];
  }
  return report;
}

}  // namespace mono_pose_tracker
