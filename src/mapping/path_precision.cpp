#include "mono_pose_tracker/mapping/path_precision.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/optimization/keyframe_covariance.h"

namespace mono_pose_tracker {

namespace {

using Keyframes = std::vector<const Keyframe*>;

// They take half a second together, and the time grows with the third power.
constexpr std::size_t kMostAtOnce = 200;

double length_of(const Keyframes& in_time) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    length += (in_time[i + 1]->center_in_map() - in_time[i]->center_in_map()).norm();
  }
  return length;
}

// Of the positions of some keyframes among themselves, summed; infinite where nothing tells it.
double sum_of_variances(const Map& map, const std::vector<KeyframeId>& keyframes) {
  const auto covariances = keyframe_covariances(keyframes, 0, std::numeric_limits<int>::max(), map);
  if (covariances.empty()) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const auto& entry : covariances) sum += entry.second.topLeftCorner<3, 3>().trace();
  return sum;
}

}  // namespace

double PathPrecision::share() const {
  return length > 0 ? sigma / length : std::numeric_limits<double>::infinity();
}

PathPrecision path_precision(const Map& map) {
  const Keyframes in_time = keyframes_in_time(map);
  PathPrecision path;
  path.length = length_of(in_time);
  const std::size_t count = in_time.size(), stretches = (count + kMostAtOnce - 1) / kMostAtOnce;
  double variance = 0;
  for (std::size_t s = 0; s < stretches; ++s) {
    const std::size_t begin = s * count / stretches, end = (s + 1) * count / stretches;
    std::vector<KeyframeId> keyframes;
    for (std::size_t i = begin; i < end; ++i) keyframes.push_back(in_time[i]->id);
    variance += sum_of_variances(map, keyframes) / static_cast<double>(end - begin);
  }
  path.sigma = std::sqrt(variance);
  return path;
}

}  // namespace mono_pose_tracker
