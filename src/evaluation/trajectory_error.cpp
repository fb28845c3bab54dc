#include "mono_pose_tracker/evaluation/trajectory_error.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "mono_pose_tracker/io/stamp.h"

namespace mono_pose_tracker {
namespace {

constexpr double kDegrees = 180 / M_PI;

// A step shorter than this share of the mean step is none: its direction is that of the reference's rounding.
constexpr double kNoMotion = 1e-3;

struct Match {
  std::size_t reference, estimate;
};

std::int64_t distance(std::int64_t a, std::int64_t b) { return a > b ? a - b : b - a; }

/// Index of the pose nearest in time; poses are sorted and not empty.
std::size_t nearest(const std::vector<StampedPose>& poses, std::int64_t stamp) {
  auto after =
      std::lower_bound(poses.begin(), poses.end(), stamp,
                       [](const StampedPose& pose, std::int64_t value) { return pose.stamp_ns < value; });
  const bool before_is_nearer =
      after == poses.end() || (after != poses.begin() && distance(std::prev(after)->stamp_ns, stamp) <
                                                             distance(after->stamp_ns, stamp));
  return (after - poses.begin()) - before_is_nearer;
}

std::vector<Match> match_by_stamp(const std::vector<StampedPose>& reference,
                                  const std::vector<StampedPose>& estimate, std::int64_t max_difference_ns) {
  if (reference.empty()) return {};
  std::map<std::size_t, std::size_t> estimate_of;  // by reference
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const std::size_t r = nearest(reference, estimate[i].stamp_ns);
    const auto difference = [&](std::size_t e) {
      return distance(reference[r].stamp_ns, estimate[e].stamp_ns);
    };
    if (difference(i) > max_difference_ns) continue;
    const auto [entry, is_new] = estimate_of.emplace(r, i);
    if (!is_new && difference(i) < difference(entry->second)) entry->second = i;
  }
  std::vector<Match> matches;
  for (const auto& [r, e] : estimate_of) matches.push_back({r, e});
  return matches;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double path_length(const std::vector<StampedPose>& poses, std::size_t first, std::size_t last) {
  double length = 0;
  for (std::size_t i = first; i < last; ++i) {
    length += (poses[i + 1].map_from_camera.translation - poses[i].map_from_camera.translation).norm();
  }
  return length;
}

/// A pair of poses of one camera: map_from_camera in the reference's and in the estimate's map.
struct PosePair {
  std::int64_t stamp_ns;
  Rigid3 reference, estimate;
};

void measure_positions(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  std::vector<Eigen::Vector3d> in_reference, in_estimate;
  for (const PosePair& pair : pairs) {
    in_reference.push_back(pair.reference.translation);
    in_estimate.push_back(pair.estimate.translation);
  }
  if (!align_sim3(in_estimate, in_reference, &error->reference_from_estimate)) {
    throw std::runtime_error(
        "the trajectories cannot be aligned: expected positions that do not all coincide");
  }
  std::vector<double> distances;
  double squares = 0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d aligned = error->reference_from_estimate * pair.estimate.translation;
    error->positions.push_back({pair.stamp_ns, pair.reference.translation, aligned});
    distances.push_back((aligned - pair.reference.translation).norm());
    squares += distances.back() * distances.back();
  }
  error->position_rmse = std::sqrt(squares / static_cast<double>(distances.size()));
  error->position_max = *std::max_element(distances.begin(), distances.end());
  error->position_median = median(std::move(distances));
}

/// The rotation R with the least sum of |reference_i - R estimate_i|_F^2.
Eigen::Quaterniond best_rotation(const std::vector<PosePair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    sum += (pair.reference.rotation * pair.estimate.rotation.conjugate()).toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose()));
}

void measure_orientations(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  const Eigen::Quaterniond reference_from_estimate = best_rotation(pairs);
  std::vector<double> angles;
  for (const PosePair& pair : pairs) {
    angles.push_back(kDegrees * rotation_angle_between(pair.reference.rotation,
                                                       reference_from_estimate * pair.estimate.rotation));
  }
  error->rotation_max_deg = *std::max_element(angles.begin(), angles.end());
  error->rotation_median_deg = median(std::move(angles));
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void measure_steps(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  std::vector<std::pair<Rigid3, Rigid3>> steps;  // camera i from camera i + 1: reference, estimate
  double length = 0;
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) {
    steps.emplace_back(pairs[i].reference.inverse() * pairs[i + 1].reference,
                       pairs[i].estimate.inverse() * pairs[i + 1].estimate);
    length += steps.back().first.translation.norm();
  }
  const double no_motion = kNoMotion * length / static_cast<double>(steps.size());
  std::vector<double> rotations, directions;
  for (const auto& [reference, estimate] : steps) {
    rotations.push_back(kDegrees * rotation_angle_between(reference.rotation, estimate.rotation));
    if (reference.translation.norm() <= no_motion) continue;
    directions.push_back(estimate.translation.isZero(0)
                             ? 180
                             : kDegrees * angle_between(reference.translation, estimate.translation));
  }
  error->relative_rotation_median_deg = median(std::move(rotations));
  error->relative_direction_median_deg = median(std::move(directions));
}

}  // namespace

TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate,
                                    std::int64_t max_difference_ns) {
  const std::vector<Match> matches = match_by_stamp(reference, estimate, max_difference_ns);
  if (matches.size() < 3) {
    throw std::runtime_error(std::to_string(matches.size()) + " of " + std::to_string(estimate.size()) +
                             " estimated poses have a reference pose within " +
                             format_stamp(max_difference_ns) + " s: expected 3 at least");
  }
  std::vector<PosePair> pairs;
  for (const Match& match : matches) {
    const StampedPose& pose = reference[match.reference];
    pairs.push_back({pose.stamp_ns, pose.map_from_camera, estimate[match.estimate].map_from_camera});
  }
  TrajectoryError error;
  error.frames_reference = static_cast<int>(reference.size());
  error.frames_matched = static_cast<int>(matches.size());
  error.reference_from_first_camera = pairs.front().reference;
  measure_positions(pairs, &error);
  error.path_length = path_length(reference, matches.front().reference, matches.back().reference);
  error.position_rmse_percent = 100 * error.position_rmse / error.path_length;
  measure_orientations(pairs, &error);
  measure_steps(pairs, &error);
  return error;
}

}  // namespace mono_pose_tracker
