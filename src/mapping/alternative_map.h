#pragma once

#include <algorithm>
#include <cstddef>

#include "keyframe_landmarks.h"

namespace mono_pose_tracker {

// A map is compared with one that it could have been mistaken for: both are adjusted, and what each costs
// tells.

constexpr double kOutlier = 2.5;  // sigmas, at which an observation's cost is capped
constexpr int kTrialIterations = 8, kIterations = 25;
// So much dearer after the first iterations, no further ones bring it near.
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
