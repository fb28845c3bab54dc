#include "quality/path_precision.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "mapping/keyframe_landmarks.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMostKeyframes = 300;  // takes three seconds
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Keyframes = std::vector<const Keyframe*>;

double step_length(const Keyframes& in_time, std::size_t to) {
  return (in_time[to]->center_in_map() - in_time[to - 1]->center_in_map()).norm();
}

double length_of(const Keyframes& in_time) {
  double length = 0;
  for (std::size_t k = 1; k < in_time.size(); ++k) length += step_length(in_time, k);
  return length;
}

double extent_of(const Keyframes& keyframes) {
  const auto count = static_cast<double>(keyframes.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Keyframe* keyframe : keyframes) middle += keyframe->center_in_map() / count;
  double squared = 0;
  for (const Keyframe* keyframe : keyframes) squared += (keyframe->center_in_map() - middle).squaredNorm();
  return std::sqrt(squared / count);
}

// Joint covariance of the positions in the map, three rows each, in the given order.
std::optional<Eigen::MatrixXd> position_covariance(const Map& map, const Keyframes& keyframes) {
  std::vector<KeyframeId> ids;
  for (const Keyframe* keyframe : keyframes) ids.push_back(keyframe->id);
  const std::optional<JointCovariance> joint =
      joint_keyframe_covariance(ids, 0, std::numeric_limits<int>::max(), map);
  if (!joint) return std::nullopt;
  std::map<KeyframeId, Eigen::Index> row;
  for (std::size_t i = 0; i < joint->keyframes.size(); ++i) row[joint->keyframes[i]] = 6 * i + 3;
  const auto count = static_cast<Eigen::Index>(keyframes.size());
  Eigen::MatrixXd covariance(3 * count, 3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Matrix3d R_i = keyframes[i]->camera_from_map.rotation_matrix();
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Matrix3d R_j = keyframes[j]->camera_from_map.rotation_matrix();
      covariance.block<3, 3>(3 * i, 3 * j) =
          R_i.transpose() * joint->covariance.block<3, 3>(row.at(ids[i]), row.at(ids[j])) * R_j;
    }
  }
  return covariance;
}

// Derivative of the path length from keyframe `first` to `last` by all positions.
Eigen::VectorXd length_by_positions(const Keyframes& in_time, std::size_t first, std::size_t last) {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(in_time.size()));
  for (std::size_t k = first + 1; k <= last; ++k) {
    const Eigen::Vector3d step =
        (in_time[k]->center_in_map() - in_time[k - 1]->center_in_map()).stableNormalized();
    const auto row = 3 * static_cast<Eigen::Index>(k);
    gradient.segment<3>(row) += step;
    gradient.segment<3>(row - 3) -= step;
  }
  return gradient;
}

// By the place of the first keyframe after the cut: number of landmarks observed on both sides.
std::vector<int> landmarks_across(const Map& map, const Keyframes& in_time) {
  std::map<KeyframeId, std::size_t> place;
  for (std::size_t k = 0; k < in_time.size(); ++k) place[in_time[k]->id] = k;
  std::vector<int> across(in_time.size() + 1, 0);
  for (const auto& entry : map.landmarks()) {
    std::size_t first = in_time.size(), last = 0;
    for (const Observation& o : entry.second.observations) {
      first = std::min(first, place.at(o.keyframe));
      last = std::max(last, place.at(o.keyframe));
    }
    if (first >= last) continue;
    ++across[first + 1];
    --across[last + 1];
  }
  for (std::size_t k = 1; k < across.size(); ++k) across[k] += across[k - 1];
  return across;
}

// The least certain cut of a part of the path. Each side needs two keyframes for a length.
ScaleCut weakest_cut(const Keyframes& in_time, const std::optional<Eigen::MatrixXd>& covariance,
                     const int* across, double length_before, double path_length) {
  ScaleCut weakest;
  if (in_time.size() < 4 || path_length <= 0) return weakest;
  double before = step_length(in_time, 1), all = length_of(in_time);
  for (std::size_t k = 2; k + 2 <= in_time.size(); before += step_length(in_time, k), ++k) {
    const double after = all - before - step_length(in_time, k);
    ScaleCut cut;
    cut.frame_index = in_time[k]->frame_index;
    cut.landmarks = across[k];
    cut.log_scale_sigma = kInfinity;
    if (covariance && cut.landmarks > 0 && before > 0 && after > 0) {
      const Eigen::VectorXd gradient = length_by_positions(in_time, k, in_time.size() - 1) / after -
                                       length_by_positions(in_time, 0, k - 1) / before;
      cut.log_scale_sigma = std::sqrt(std::max(0.0, gradient.dot(*covariance * gradient)));
    }
    const double share = (length_before + before) / path_length;
    cut.path_share = std::max(0.0, std::min(share, 1 - share - step_length(in_time, k) / path_length));
    if (cut.path_sigma() > weakest.path_sigma()) weakest = cut;
  }
  return weakest;
}

}  // namespace

double ScaleCut::path_sigma() const { return path_share > 0 ? log_scale_sigma * path_share : 0; }

double PathPrecision::share() const { return length > 0 ? sigma / length : kInfinity; }

PathPrecision path_precision(const Map& map) {
  const Keyframes in_time = keyframes_in_time(map);
  const std::vector<int> across = landmarks_across(map, in_time);
  PathPrecision path{0, length_of(in_time), extent_of(in_time), {}};
  const std::size_t halves = (2 * in_time.size() + kMostKeyframes - 1) / kMostKeyframes;
  const std::size_t parts = in_time.size() <= kMostKeyframes ? 1 : halves - 1;
  const std::size_t size = parts == 1 ? in_time.size() : (2 * in_time.size() + halves - 1) / halves;
  for (std::size_t i = 0; i < parts && size > 0; ++i) {
    const std::size_t from = parts == 1 ? 0 : i * (in_time.size() - size) / (parts - 1);
    const auto at = in_time.begin() + static_cast<std::ptrdiff_t>(from);
    const Keyframes part(at, at + static_cast<std::ptrdiff_t>(size));
    const std::optional<Eigen::MatrixXd> covariance = position_covariance(map, part);
    const auto count = static_cast<double>(size);
    path.sigma = std::max(path.sigma, covariance ? std::sqrt(covariance->trace() / count) : kInfinity);
    const Keyframes before(in_time.begin(), at + 1);
    const ScaleCut cut = weakest_cut(part, covariance, &across[from], length_of(before), path.length);
    if (cut.path_sigma() > path.weakest.path_sigma()) path.weakest = cut;
  }
  return path;
}

}  // namespace mono_pose_tracker
