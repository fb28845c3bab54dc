#include "evaluation/doubt_error.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "common/rotation.h"
#include "common/statistics.h"
#include "geometry/nearest_rotation.h"
#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {
namespace {

struct Pair {
  const ReportedPose* reported;
  const Rigid3* reference;
};

using Residual = std::function<double(const Pair&)>;

// Weights of Huber's loss with the median residual as width: outliers pull no harder than inliers.
std::vector<double> weights_of(const std::vector<Pair>& pairs, const Residual& residual) {
  std::vector<double> residuals, weights;
  for (const Pair& pair : pairs) residuals.push_back(residual(pair));
  const double width = std::max(median(residuals), 1e-12);
  for (const double r : residuals) weights.push_back(1 / std::max(r, width));
  return weights;
}

// Umeyama's similarity, weighted.
Sim3 align_positions(const std::vector<Pair>& pairs, const std::vector<double>& weights) {
  double sum = 0, variance = 0;
  Eigen::Vector3d mean_map = Eigen::Vector3d::Zero(), mean_reference = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sum += weights[i];
    mean_map += weights[i] * pairs[i].reported->map_from_camera.translation;
    mean_reference += weights[i] * pairs[i].reference->translation;
  }
  mean_map /= sum;
  mean_reference /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d in_map = pairs[i].reported->map_from_camera.translation - mean_map;
    covariance += weights[i] * (pairs[i].reference->translation - mean_reference) * in_map.transpose();
    variance += weights[i] * in_map.squaredNorm();
  }
  Sim3 reference_from_map;
  const Eigen::Matrix3d rotation = nearest_rotation(covariance);
  if (variance > 0) reference_from_map.scale = (rotation.transpose() * covariance).trace() / variance;
  reference_from_map.rotation = Eigen::Quaterniond(rotation);
  reference_from_map.translation = mean_reference - reference_from_map.scale * (rotation * mean_map);
  return reference_from_map;
}

Eigen::Quaterniond align_orientations(const std::vector<Pair>& pairs, const std::vector<double>& weights) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Quaterniond& in_map = pairs[i].reported->map_from_camera.rotation;
    sum += weights[i] * (pairs[i].reference->rotation * in_map.conjugate()).toRotationMatrix();
  }
  return Eigen::Quaterniond(nearest_rotation(sum));
}

double position_error(const Pair& pair, const Sim3& reference_from_map) {
  return (reference_from_map * pair.reported->map_from_camera.translation - pair.reference->translation)
      .norm();
}

double rotation_error_deg(const Pair& pair, const Eigen::Quaterniond& reference_from_map) {
  return pair.reference->rotation.angularDistance(reference_from_map *
                                                  pair.reported->map_from_camera.rotation) /
         kDegree;
}

void add_deviations(const std::vector<Pair>& pairs, const DeviationOptions& options,
                    std::vector<PoseDeviation>* deviations) {
  if (pairs.size() < options.min_poses) return;
  const std::vector<double> equal(pairs.size(), 1);
  Sim3 reference_from_map = align_positions(pairs, equal);
  Eigen::Quaterniond rotation = align_orientations(pairs, equal);
  for (int step = 0; step < options.steps; ++step) {
    reference_from_map = align_positions(
        pairs, weights_of(pairs, [&](const Pair& p) { return position_error(p, reference_from_map); }));
    rotation = align_orientations(
        pairs, weights_of(pairs, [&](const Pair& p) { return rotation_error_deg(p, rotation); }));
  }
  for (const Pair& pair : pairs) {
    deviations->push_back({pair.reported->stamp_ns, position_error(pair, reference_from_map),
                           rotation_error_deg(pair, rotation), pair.reported->doubtful, false});
  }
}

template <typename Value>
double median_of(const std::vector<PoseDeviation>& deviations, Value value) {
  std::vector<double> values;
  values.reserve(deviations.size());
  for (const PoseDeviation& deviation : deviations) values.push_back(value(deviation));
  return median(std::move(values));
}

}  // namespace

std::vector<PoseDeviation> deviations_of(const std::vector<StampedPose>& reference,
                                         const std::vector<ReportedPose>& reported,
                                         const DeviationOptions& options) {
  std::map<std::int64_t, const Rigid3*> known;
  for (const StampedPose& pose : reference) known[pose.stamp_ns] = &pose.map_from_camera;
  std::map<std::uint32_t, std::vector<Pair>> maps;
  for (const ReportedPose& pose : reported) {
    const auto found = known.find(pose.stamp_ns);
    if (found != known.end()) maps[pose.map_id].push_back({&pose, found->second});
  }
  std::vector<PoseDeviation> deviations;
  for (const auto& entry : maps) add_deviations(entry.second, options, &deviations);
  const double position = median_of(deviations, [](const PoseDeviation& d) { return d.position; });
  const double rotation = median_of(deviations, [](const PoseDeviation& d) { return d.rotation_deg; });
  for (PoseDeviation& d : deviations) {
    d.off = d.position > options.off * position || d.rotation_deg > options.off * rotation;
  }
  std::sort(deviations.begin(), deviations.end(),
            [](const PoseDeviation& a, const PoseDeviation& b) { return a.stamp_ns < b.stamp_ns; });
  return deviations;
}

}  // namespace mono_pose_tracker
