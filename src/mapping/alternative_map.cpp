#include "alternative_map.h"

#include <cmath>

#include "common/statistics.h"

namespace mono_pose_tracker {

namespace {

// Of an observation that the map may have lost.
double capped_error2(const Map& map, const Observation& observation, double outlier_sigmas) {
  const double cap = outlier_sigmas * outlier_sigmas;
  const Keyframe* keyframe = map.keyframe(observation.keyframe);
  const Landmark* landmark =
      keyframe ? map.landmark(keyframe->landmark_of_feature[observation.feature]) : nullptr;
  if (!landmark) return cap;
  const double error = error_px(*keyframe, observation.feature, landmark->x_in_map);
  return std::min(error * error, cap);
}

}  // namespace

double p_value_of(const Map& alternative, const Map& map, double outlier_sigmas) {
  const auto count = static_cast<double>(map.landmarks().size());
  if (count < 2) return 1;
  double sum = 0, squared = 0;
  for (const auto& entry : map.landmarks()) {
    double extra = 0;
    for (const Observation& o : entry.second.observations)
      extra += capped_error2(alternative, o, outlier_sigmas) - capped_error2(map, o, outlier_sigmas);
    sum += extra;
    squared += extra * extra;
  }
  const double variance = (squared - sum * sum / count) / (count - 1);  // of a difference
  if (variance <= 0) return sum > 0 ? 0 : 1;
  return student_tail(sum / std::sqrt(count * variance), static_cast<int>(count) - 1);
}

}  // namespace mono_pose_tracker
