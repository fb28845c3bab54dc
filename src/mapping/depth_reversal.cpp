#include "mapping/depth_reversal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/rotation.h"
#include "common/threads.h"
#include "keyframe_landmarks.h"
#include "mapping/motion_segmentation.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

Eigen::Matrix3d about(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

// Sense of the rotation after the transformation.
enum class RotationSense { kReversed, kSame };

// Keeps the rotation about the viewing axis and multiplies the tilt by `stretch`.
Eigen::Matrix3d turned(const Eigen::Matrix3d& turn, RotationSense sense, double stretch) {
  const double tilt = std::acos(std::clamp(turn(2, 2), -1.0, 1.0));
  if (tilt < 1e-5) return turn;  // its direction would be rounding noise
  const double after = std::atan2(turn(1, 2), turn(0, 2)), before = std::atan2(turn(2, 1), -turn(2, 0));
  const double far = std::min(stretch * tilt, std::max(tilt, kAlternativeMaps.max_tilt));
  return about(after, Eigen::Vector3d::UnitZ()) *
         about(sense == RotationSense::kReversed ? -far : far, Eigen::Vector3d::UnitY()) *
         about(before, Eigen::Vector3d::UnitZ());
}

void mistake_depth(RotationSense sense, double stretch, Map* map) {
  if (map->keyframes().empty()) return;
  const Rigid3 first_from_map = map->keyframes().begin()->second.camera_from_map;
  const Eigen::Vector3d middle = median_position(*map, first_from_map);
  const Eigen::Vector3d view_axis = middle.normalized();
  const Eigen::Matrix3d align_first = rotation_between(view_axis, Eigen::Vector3d::UnitZ());
  for (const LandmarkId l : map->landmark_ids()) {
    const Eigen::Vector3d off = first_from_map * map->landmark(l)->x_in_map - middle;
    const double deep = (sense == RotationSense::kReversed ? -1 : 1) / stretch;
    const Eigen::Vector3d other_off = off - (1 - deep) * view_axis.dot(off) * view_axis;
    map->set_position(l, first_from_map.inverse() * (middle + other_off));
  }
  std::vector<std::pair<KeyframeId, Rigid3>> poses;
  for (const auto& [id, keyframe] : map->keyframes()) {
    const Rigid3 from_first = keyframe.camera_from_map * first_from_map.inverse();
    const Eigen::Vector3d middle_here = from_first * middle;
    const Eigen::Matrix3d align_here = rotation_between(middle_here.normalized(), Eigen::Vector3d::UnitZ());
    const Eigen::Matrix3d turn = align_here * from_first.rotation_matrix() * align_first.transpose();
    const Eigen::Matrix3d rotation = align_here.transpose() * turned(turn, sense, stretch) * align_first;
    poses.emplace_back(id, Rigid3(rotation, middle_here - rotation * middle) * first_from_map);
  }
  for (const auto& [id, pose] : poses) map->set_pose(id, pose);
}

}  // namespace

void reverse_depth(double stretch, Map* map) { mistake_depth(RotationSense::kReversed, stretch, map); }

void stretch_depth(double stretch, Map* map) { mistake_depth(RotationSense::kSame, stretch, map); }

bool is_narrow(const std::vector<Eigen::Vector3d>& bearings) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& bearing : bearings) sum += bearing;
  const Eigen::Vector3d middle = sum.normalized();
  double off2 = 0;
  for (const Eigen::Vector3d& bearing : bearings) off2 += (bearing - middle).squaredNorm();
  return !bearings.empty() && std::sqrt(off2 / bearings.size()) < kAlternativeMaps.narrow;
}

// Bearing of the centroid in each keyframe. A few of thousands suffice to detect a wide map.
bool is_narrow(const Map& map) {
  const double most =
      kAlternativeMaps.narrow * kAlternativeMaps.narrow * static_cast<double>(count_observations(map));
  double sum = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Eigen::Vector3d middle = median_position(map, keyframe.camera_from_map).normalized();
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      if (keyframe.landmark_of_feature[f] == kNoLandmark) continue;
      sum += (keyframe.image->set.bearings[f] - middle).squaredNorm();
    }
    if (sum >= most) return false;
  }
  return most > 0;
}

namespace {

// Bundle options for one of several maps that are adjusted in parallel.
BundleOptions trial_of(std::size_t alternatives, const BundleOptions& bundle, int iterations) {
  BundleOptions trial = bundle;
  trial.max_iterations = iterations;
  const auto count = static_cast<int>(alternatives);
  trial.own_threads = (bundle.own_threads + count - 1) / count;
  return trial;
}

// Whether the rotations differ visibly, for a head or a bust.
bool rotates_differently(double turn, double other) {
  const double plainly = MotionSegmentationOptions().plainly_rotates;
  return turn >= plainly * other || other >= plainly * turn;
}

// p-value of the stretched map; 0 where it converges to the map again, or nearly.
double p_value_when_stretched(BundleOptions trial, const Map& map, double cost, double stretch) {
  const double own_rotation = rotation_before_cameras(map);
  Map alternative = map;
  stretch_depth(stretch, &alternative);
  for (int round = 0; round < kAlternativeMaps.max_stretched_rounds; ++round) {
    adjust_map(trial, &alternative);
    if (cost_of(alternative) > kAlternativeMaps.far_higher_cost * cost ||
        !rotates_differently(rotation_before_cameras(alternative), own_rotation))
      return 0;
    trial.max_iterations = kAlternativeMaps.max_iterations;
  }
  return p_value_of(alternative, map);
}

double highest_p_value_when_stretched(const BundleOptions& bundle, const Map& map, double cost) {
  const BundleOptions trial =
      trial_of(kAlternativeMaps.stretches.size(), bundle, kAlternativeMaps.trial_iterations);
  std::vector<double> p_values(kAlternativeMaps.stretches.size());
  parallel_for(static_cast<int>(p_values.size()), bundle.own_threads, [&](int i) {
    p_values[i] = p_value_when_stretched(trial, map, cost, kAlternativeMaps.stretches[i]);
  });
  return *std::max_element(p_values.begin(), p_values.end());
}

// The depth-reversed map with the lowest cost, adjusted as far as the comparison needs.
Map cheapest_reversal(const BundleOptions& bundle, const Map& map, double cost, double* alternative_cost) {
  const auto& stretches = kAlternativeMaps.reversed_stretches;
  BundleOptions trial = trial_of(stretches.size(), bundle, kAlternativeMaps.trial_iterations);
  std::vector<Map> alternatives(stretches.size());
  std::vector<double> costs(stretches.size());
  parallel_for(static_cast<int>(stretches.size()), bundle.own_threads, [&](int i) {
    alternatives[i] = map;
    reverse_depth(stretches[i], &alternatives[i]);
    adjust_map(trial, &alternatives[i]);
    costs[i] = cost_of(alternatives[i]);
  });
  const auto cheapest = std::min_element(costs.begin(), costs.end());
  Map best = std::move(alternatives[cheapest - costs.begin()]);
  *alternative_cost = *cheapest;
  if (*alternative_cost > kAlternativeMaps.far_higher_cost * cost) return best;
  trial.own_threads = bundle.own_threads;
  trial.max_iterations = kAlternativeMaps.max_iterations;
  adjust_map(trial, &best);
  *alternative_cost = cost_of(best);
  return best;
}

}  // namespace

bool correct_depth_reversal(const BundleOptions& bundle, double min_evidence, Map* map) {
  double alternative_cost = 0;
  if (const std::optional<Map> sample = sample_of(bundle, *map)) {
    const double cost = cost_of(*sample);
    cheapest_reversal(bundle, *sample, cost, &alternative_cost);
    if (alternative_cost * (1 + min_evidence) >= kAlternativeMaps.sampled_margin * cost) return false;
  }
  const double cost = cost_of(*map);
  Map alternative = cheapest_reversal(bundle, *map, cost, &alternative_cost);
  if (alternative_cost * (1 + min_evidence) >= cost) return false;
  *map = std::move(alternative);
  return true;
}

double reversal_p_value(const BundleOptions& bundle, const Map& map) {
  if (!is_narrow(map)) return 0;
  const std::optional<Map> sample = sample_of(bundle, map);
  const Map& compared = sample ? *sample : map;
  const double cost = cost_of(compared);
  double alternative_cost = 0;
  const Map reversed = cheapest_reversal(bundle, compared, cost, &alternative_cost);
  const bool is_far_higher = alternative_cost > kAlternativeMaps.far_higher_cost * cost;
  return std::max(is_far_higher ? 0 : p_value_of(reversed, compared),
                  highest_p_value_when_stretched(bundle, compared, cost));
}

}  // namespace mono_pose_tracker
