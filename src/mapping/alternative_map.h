#pragma once

#include <algorithm>
#include <cstddef>

#include "keyframe_landmarks.h"

namespace mono_pose_tracker {

// Compares a map with an alternative hypothesis that explains its images about as well: both are adjusted,
// and their costs decide.

constexpr double kOutlier = 2.5;  // sigmas, at which an observation's cost is capped
constexpr int kTrialIterations = 8, kIterations = 25;
// A cost higher by this factor after the first iterations is not brought near by further ones.
constexpr double kFarHigherCost = 3;

inline double cost_of(const Map& map) {
  double cost = 0;
  for (const auto& entry : map.keyframes()) {
    const Keyframe& keyframe = entry.second;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
      if (!landmark) continue;
      const double error = error_px(keyframe, static_cast<int>(f), landmark->x_in_map);
      cost += std::min(error * error, kOutlier * kOutlier);
    }
  }
  return cost;
}

}  // namespace mono_pose_tracker
