#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

/// Adds the k-th keyframe, a tenth of a second after the previous one. It observes each point as the landmark
/// of that number.
inline void add_view(const SyntheticScene& scene, const CameraModel& camera, const Rigid3& camera_from_map,
                     double noise_px, int k, const std::vector<LandmarkId>& landmarks, Random& random,
                     Map* map) {
  std::vector<int> point_of;
  const Frame frame = synthetic_frame(scene, camera, camera_from_map, noise_px, k, random, &point_of);
  const KeyframeId id = map->add_keyframe(k, k * std::int64_t{100'000'000}, camera_from_map, frame.image);
  for (std::size_t f = 0; f < point_of.size(); ++f) {
    map->add_observation(landmarks[point_of[f]], id, static_cast<int>(f));
  }
}

}  // namespace mono_pose_tracker
