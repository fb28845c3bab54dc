#pragma once

#include <cstddef>
#include <unordered_set>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Candidates for the landmarks that the keyframes observe: one for each landmark, with the descriptor from
// the first keyframe that observes it. excluded: landmarks that are none.
inline std::vector<LandmarkCandidate> candidates_of(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                    const std::unordered_set<LandmarkId>& excluded = {}) {
  std::vector<LandmarkCandidate> candidates;
  std::unordered_set<LandmarkId> known = excluded;
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = *map.keyframe(id);
    const Eigen::Vector3d center = keyframe.center_in_map();
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark || !known.insert(l).second) continue;
      candidates.push_back(
          make_candidate(l, map.landmark(l)->x_in_map, *keyframe.image, static_cast<int>(f), center));
    }
  }
  return candidates;
}

}  // namespace mono_pose_tracker
