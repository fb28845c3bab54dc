#include "robust/position_alignment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/rotation.h"
#include "common/statistics.h"
#include "robust/sampler.h"

namespace mono_pose_tracker {
namespace {

using Pairs = std::vector<PositionPair>;

double squared_error(const Sim3& world_from_map, const PositionPair& pair) {
  return (world_from_map * pair.in_map - pair.in_world).squaredNorm();
}

double median_squared_error(const Sim3& world_from_map, const Pairs& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PositionPair& pair : pairs) errors.push_back(squared_error(world_from_map, pair));
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

Pairs evenly_spread(const Pairs& pairs, int most) {
  if (pairs.size() <= static_cast<std::size_t>(most)) return pairs;
  Pairs some;
  for (int i = 0; i < most; ++i) some.push_back(pairs[i * pairs.size() / static_cast<std::size_t>(most)]);
  return some;
}

bool fit(const Pairs& pairs, const std::vector<char>& inliers, Sim3* world_from_map) {
  std::vector<Eigen::Vector3d> a, b;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!inliers[i]) continue;
    a.push_back(pairs[i].in_map);
    b.push_back(pairs[i].in_world);
  }
  return align_sim3(a, b, world_from_map) && std::isfinite(world_from_map->scale) &&
         world_from_map->scale > 0;
}

/// The extent of the measured positions: a median distance from their median.
double extent_of(const Pairs& pairs) {
  Eigen::Vector3d centre;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const PositionPair& pair : pairs) values.push_back(pair.in_world[axis]);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    centre[axis] = *middle;
  }
  Pairs from_centre = pairs;
  for (PositionPair& pair : from_centre) pair.in_map = centre;
  return std::sqrt(median_squared_error(Sim3(), from_centre));
}

/// The best of the samples; false when none fits at all.
bool sample(const Pairs& pairs, const PositionAlignmentOptions& options, Sim3* best) {
  const Pairs scored = evenly_spread(pairs, options.max_scored);
  Random random(options.seed);
  UniformSampler sampler(static_cast<int>(pairs.size()), 3);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < options.samples; ++i) {
    int drawn[3];
    sampler.draw(&random, drawn);
    Eigen::Matrix3d a, b;
    for (int k = 0; k < 3; ++k) a.col(k) = pairs[drawn[k]].in_map, b.col(k) = pairs[drawn[k]].in_world;
    Sim3 candidate;
    if (!align_sim3(a, b, &candidate) || !std::isfinite(candidate.scale) || !(candidate.scale > 0)) continue;
    const double median = median_squared_error(candidate, scored);
    if (median < least) least = median, *best = candidate;
  }
  return std::isfinite(least);
}

/// Least squares on the inliers of the noise level that the median of the errors gives, until these stay.
bool refine(const Pairs& pairs, const PositionAlignmentOptions& options, PositionAlignment* result) {
  const double least_sigma = options.min_relative_sigma * extent_of(pairs);
  // Three positions are fitted whatever the noise, so few errors look smaller than they are.
  const double small_sample = 1 + options.small_sample / static_cast<double>(pairs.size() - 3);
  result->inliers.assign(pairs.size(), 0);
  for (int i = 0; i < options.max_refinements; ++i) {
    const double variance =
        std::max(small_sample * small_sample *
                     variance_of_median_square(median_squared_error(result->world_from_map, pairs)),
                 least_sigma * least_sigma);
    std::vector<char> inliers;
    for (const PositionPair& pair : pairs) {
      inliers.push_back(squared_error(result->world_from_map, pair) <= options.max_squared_error * variance);
    }
    if (inliers == result->inliers) return true;
    result->inliers = inliers;
    if (!fit(pairs, inliers, &result->world_from_map)) return false;
  }
  return true;
}

void measure(const Pairs& pairs, PositionAlignment* result) {
  double sum = 0;
  result->errors.clear();
  result->num_inliers = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double squared = squared_error(result->world_from_map, pairs[i]);
    result->errors.push_back(std::sqrt(squared));
    if (!result->inliers[i]) continue;
    sum += squared;
    ++result->num_inliers;
  }
  const int count = result->num_inliers;
  result->inlier_rms = count > 0 ? std::sqrt(sum / count) : 0;
  // A similarity has seven degrees of freedom.
  result->sigma = std::sqrt(sum / std::max(1, 3 * count - 7));
}

/// Standard deviations of rotation and scale by first-order propagation; the axis about which the rotation is
/// known least, in the world.
Eigen::Vector3d propagate(const Pairs& pairs, PositionAlignment* result) {
  const Sim3& s = result->world_from_map;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (result->inliers[i]) mean += s * pairs[i].in_map / result->num_inliers;
  }
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double spread = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!result->inliers[i]) continue;
    const Eigen::Vector3d d = s * pairs[i].in_map - mean;
    information += d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose();
    spread += d.squaredNorm();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  const double least = std::max(solver.eigenvalues()[0], 0.0);
  result->rotation_sigma_deg =
      least > 0 ? result->sigma / std::sqrt(least) / kDegree : std::numeric_limits<double>::infinity();
  result->scale_sigma =
      spread > 0 ? result->sigma / std::sqrt(spread) : std::numeric_limits<double>::infinity();
  return solver.eigenvectors().col(0);
}

/// Turns the alignment about the axis through the middle of the positions so that the directions agree best.
/// False, and nothing changed, where they contradict it then.
bool turn_by_directions(const Pairs& pairs, const std::vector<DirectionPair>& directions,
                        const Eigen::Vector3d& axis, double max_angle_deg, PositionAlignment* result) {
  double along = 0, across = 0;
  for (const DirectionPair& direction : directions) {
    const Eigen::Vector3d v = result->world_from_map.rotation * direction.in_map;
    const Eigen::Vector3d& w = direction.in_world;
    along += w.dot(v) - w.dot(axis) * axis.dot(v);
    across += w.dot(axis.cross(v));
  }
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::atan2(across, along), axis));
  Sim3 turned = result->world_from_map;
  turned.rotation = (turn * turned.rotation).normalized();
  for (const DirectionPair& direction : directions) {
    const double angle = angle_between(direction.in_world, turned.rotation * direction.in_map);
    if (angle > max_angle_deg * kDegree) return false;
  }
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = mean_a;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!result->inliers[i]) continue;
    mean_a += pairs[i].in_map / result->num_inliers;
    mean_b += pairs[i].in_world / result->num_inliers;
  }
  turned.translation = mean_b - turned.scale * (turned.rotation * mean_a);
  result->world_from_map = turned;
  return true;
}

PositionAlignment failed(PositionAlignment result, const std::string& problem) {
  result.success = false;
  result.problem = problem;
  return result;
}

}  // namespace

PositionAlignment align_positions(const std::vector<PositionPair>& pairs,
                                  const std::vector<DirectionPair>& directions,
                                  const PositionAlignmentOptions& options) {
  PositionAlignment result;
  const std::string count = std::to_string(pairs.size());
  if (pairs.size() < static_cast<std::size_t>(std::max(options.min_inliers, 4))) {
    return failed(result, count + " of the positions belong to registered images, expected at least " +
                              std::to_string(std::max(options.min_inliers, 4)));
  }
  if (!sample(pairs, options, &result.world_from_map) || !refine(pairs, options, &result)) {
    return failed(result, "the " + count + " positions coincide, expected a path");
  }
  measure(pairs, &result);
  const Eigen::Vector3d weakest_axis = propagate(pairs, &result);
  const double least = std::max<double>(options.min_inliers, options.min_inlier_share * pairs.size());
  if (result.num_inliers < least) {
    return failed(result, "only " + std::to_string(result.num_inliers) + " of " + count +
                              " positions fit one similarity transform of the path");
  }
  if (!(result.scale_sigma <= options.max_scale_sigma)) {
    return failed(result, "the positions do not determine the scale: the path is too short for their noise");
  }
  if (result.rotation_sigma_deg > options.max_rotation_sigma_deg && !directions.empty()) {
    result.used_directions =
        turn_by_directions(pairs, directions, weakest_axis, options.max_direction_angle_deg, &result);
    measure(pairs, &result);
  }
  result.success = true;
  return result;
}

}  // namespace mono_pose_tracker
