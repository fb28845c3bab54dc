#include "mono_pose_tracker/mapping/path_precision.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/optimization/keyframe_covariance.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMostKeyframes = 300;

using Keyframes = std::vector<const Keyframe*>;
using Variances = std::map<KeyframeId, double>;  // of positions

Variances variances_of(const Map& map, const Keyframes& keyframes) {
  std::vector<KeyframeId> ids;
  for (const Keyframe* keyframe : keyframes) ids.push_back(keyframe->id);
  Variances variances;
  for (const auto& [id, covariance] : keyframe_covariances(ids, 0, std::numeric_limits<int>::max(), map)) {
    variances[id] = covariance.topLeftCorner<3, 3>().trace();
  }
  return variances;
}

// Where the camera hardly moves, what noise adds to each step would make a way of nothing but noise the
// longer, and the better known, the more keyframes there are.
double length_of(const Keyframes& in_time, const Variances& variances) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    const Keyframe &from = *in_time[i], &to = *in_time[i + 1];
    const double squared = (to.center_in_map() - from.center_in_map()).squaredNorm();
    length += std::sqrt(std::max(0.0, squared - variances.at(from.id) - variances.at(to.id)));
  }
  return length;
}

}  // namespace

double PathPrecision::share() const {
  return length > 0 ? sigma / length : std::numeric_limits<double>::infinity();
}

std::optional<PathPrecision> path_precision(const Map& map) {
  const Keyframes in_time = keyframes_in_time(map);
  if (in_time.size() > kMostKeyframes) return std::nullopt;
  const Variances variances = variances_of(map, in_time);
  PathPrecision path;
  if (variances.empty()) {
    path.sigma = std::numeric_limits<double>::infinity();
    return path;
  }
  double sum = 0;
  for (const auto& entry : variances) sum += entry.second;
  path.sigma = std::sqrt(sum / static_cast<double>(variances.size()));
  path.length = length_of(in_time, variances);
  return path;
}

}  // namespace mono_pose_tracker
