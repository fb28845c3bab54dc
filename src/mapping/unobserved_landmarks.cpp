#include "unobserved_landmarks.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace mono_pose_tracker {

namespace {

class UnobservedInView {
 public:
  UnobservedInView(const Map& map, const Keyframe& keyframe, double radius_px)
      : map_(map), keyframe_(keyframe), radius_px_(radius_px), center_(keyframe.center_in_map()) {}

  void offer(const Landmark& landmark) {
    if (!is_near_a_feature(landmark.x_in_map) || is_seen(landmark)) return;
    const Observation* nearest = nearest_in_direction(landmark);
    if (!nearest) return;
    candidates_.push_back(make_candidate(landmark.id, landmark.x_in_map,
                                         *map_.keyframe(nearest->keyframe)->image, nearest->feature,
                                         center_of(nearest->keyframe)));
  }

  std::vector<LandmarkCandidate> take() { return std::move(candidates_); }

 private:
  // Tested first: it rejects most landmarks cheaply.
  bool is_near_a_feature(const Eigen::Vector3d& x_in_map) const {
    const ImageFeatures& image = *keyframe_.image;
    Eigen::Vector2d pixel;
    return image.camera.project(keyframe_.camera_from_map * x_in_map, &pixel) &&
           image.camera.in_image(pixel) && image.grid.has_near(pixel, radius_px_);
  }

  bool is_seen(const Landmark& landmark) const {
    return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                       [&](const Observation& o) { return o.keyframe == keyframe_.id; });
  }

  const Observation* nearest_in_direction(const Landmark& landmark) {
    const Eigen::Vector3d direction = (center_ - landmark.x_in_map).normalized();
    const Observation* nearest = nullptr;
    double best_cosine = -2;
    for (const Observation& o : landmark.observations) {
      const Eigen::Vector3d ray = center_of(o.keyframe) - landmark.x_in_map;
      const double cosine = ray.normalized().dot(direction);
      if (cosine > best_cosine) best_cosine = cosine, nearest = &o;
    }
    return nearest;
  }

  const Eigen::Vector3d& center_of(KeyframeId id) {
    const auto [entry, is_new] = centers_.try_emplace(id);
    if (is_new) entry->second = map_.keyframe(id)->center_in_map();
    return entry->second;
  }

  const Map& map_;
  const Keyframe& keyframe_;
  const double radius_px_;
  const Eigen::Vector3d center_;
  std::unordered_map<KeyframeId, Eigen::Vector3d> centers_;  // of other keyframes, computed on demand
  std::vector<LandmarkCandidate> candidates_;
};

}  // namespace

std::vector<LandmarkCandidate> unobserved_in_view(const Map& map, const Keyframe& keyframe,
                                                  const std::optional<std::vector<LandmarkId>>& landmarks,
                                                  double radius_px) {
  UnobservedInView unseen(map, keyframe, radius_px);
  if (landmarks) {
    for (const LandmarkId l : *landmarks) unseen.offer(*map.landmark(l));
    return unseen.take();
  }
  for (const auto& entry : map.landmarks()) unseen.offer(entry.second);
  std::vector<LandmarkCandidate> candidates = unseen.take();
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return candidates;
}

}  // namespace mono_pose_tracker
