#include "unseen_landmarks.h"

#include <algorithm>
#include <unordered_map>

namespace mono_pose_tracker {

std::vector<LandmarkCandidate> unseen_in_view(const Map& map, const Keyframe& keyframe,
                                              const std::vector<LandmarkId>& landmarks) {
  const CameraModel& camera = keyframe.image->camera;
  const Eigen::Vector3d center = keyframe.center_in_map();
  std::unordered_map<KeyframeId, Eigen::Vector3d> centers;  // of the others, as far as they are asked for
  const auto center_of = [&](KeyframeId id) -> const Eigen::Vector3d& {
    const auto [entry, is_new] = centers.try_emplace(id);
    if (is_new) entry->second = map.keyframe(id)->center_in_map();
    return entry->second;
  };
  std::vector<LandmarkCandidate> candidates;
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map.landmark(l);
    const bool is_seen = std::any_of(landmark.observations.begin(), landmark.observations.end(),
                                     [&](const Observation& o) { return o.keyframe == keyframe.id; });
    Eigen::Vector2d pixel;
    if (is_seen || !camera.project(keyframe.camera_from_map * landmark.x_in_map, &pixel) ||
        !camera.in_image(pixel)) {
      continue;
    }
    const Eigen::Vector3d direction = (center - landmark.x_in_map).normalized();
    const Observation* nearest = nullptr;
    double best_cosine = -2;
    for (const Observation& o : landmark.observations) {
      const Eigen::Vector3d ray = center_of(o.keyframe) - landmark.x_in_map;
      const double cosine = ray.normalized().dot(direction);
      if (cosine > best_cosine) best_cosine = cosine, nearest = &o;
    }
    if (!nearest) continue;
    candidates.push_back(make_candidate(l, landmark.x_in_map, *map.keyframe(nearest->keyframe)->image,
                                        nearest->feature, center_of(nearest->keyframe)));
  }
  return candidates;
}

}  // namespace mono_pose_tracker
