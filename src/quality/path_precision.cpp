#include "quality/path_precision.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "mapping/keyframe_landmarks.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

using Keyframes = std::vector<const Keyframe*>;

double extent_of(const Keyframes& keyframes) {
  const auto count = static_cast<double>(keyframes.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Keyframe* keyframe : keyframes) middle += keyframe->center_in_map() / count;
  double squared = 0;
  for (const Keyframe* keyframe : keyframes) squared += (keyframe->center_in_map() - middle).squaredNorm();
  return std::sqrt(squared / count);
}

// Standard deviation of a position; infinite where it is not constrained.
double sigma_of(const Map& map, const Keyframes& keyframes) {
  std::vector<KeyframeId> ids;
  for (const Keyframe* keyframe : keyframes) ids.push_back(keyframe->id);
  const auto covariances = keyframe_covariances(ids, 0, std::numeric_limits<int>::max(), map);
  if (covariances.empty()) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const auto& entry : covariances) sum += entry.second.topLeftCorner<3, 3>().trace();
  return std::sqrt(sum / static_cast<double>(covariances.size()));
}

}  // namespace

double PathPrecision::share() const {
  return length > 0 ? sigma / length : std::numeric_limits<double>::infinity();
}

PathPrecision path_precision(const Map& map, std::size_t most_keyframes) {
  const Keyframes in_time = keyframes_in_time(map);
  const std::size_t parts = (in_time.size() + most_keyframes - 1) / most_keyframes;
  PathPrecision path{0, path_lengths(in_time).back(), extent_of(in_time), weakest_scale_cut(map)};
  for (std::size_t part = 0; part < parts; ++part) {
    const auto at = [&](std::size_t i) {
      return in_time.begin() + static_cast<std::ptrdiff_t>(i * in_time.size() / parts);
    };
    path.sigma = std::max(path.sigma, sigma_of(map, Keyframes(at(part), at(part + 1))));
  }
  return path;
}

}  // namespace mono_pose_tracker
