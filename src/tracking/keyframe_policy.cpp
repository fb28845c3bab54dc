#include "keyframe_policy.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "geometry/triangulation.h"

namespace mono_pose_tracker {

constexpr KeyframePolicyOptions kPolicy{};

Overlap overlap_with(const TrackingMap& map, KeyframeId id, const RegistrationReport& registration,
                     const CameraModel& camera) {
  Overlap overlap;
  const KeyframeView& keyframe = map.keyframes.at(id);
  const Eigen::Vector3d there = keyframe.camera_from_map.inverse().translation;
  const Eigen::Vector3d here = registration.camera_from_map.inverse().translation;
  std::vector<double> angles;
  for (const FrameObservation& o : registration.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    if (landmark == map.landmarks.end()) continue;
    angles.push_back(parallax_angle(landmark->second, there, here));
  }
  overlap.parallax_deg = median(std::move(angles)) / kDegree;
  int in_view = 0, landmarks = 0;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    const auto landmark = map.landmarks.find(l);
    if (landmark == map.landmarks.end()) continue;
    ++landmarks;
    Eigen::Vector2d pixel;
    in_view +=
        camera.project(registration.camera_from_map * landmark->second, &pixel) && camera.in_image(pixel);
  }
  if (landmarks > 0) overlap.in_view = static_cast<double>(in_view) / landmarks;
  return overlap;
}

bool KeyframePolicy::is_due(const TrackingMap& map, const Overlap& overlap, int inliers,
                            int unfinished_jobs) {
  const KeyframeId newest = map.keyframes.rbegin()->first;
  if (newest != newest_keyframe_) most_inliers_ = 0;
  newest_keyframe_ = newest;
  most_inliers_ = std::max(most_inliers_, inliers);
  // While one mapping job is running the next may wait. Behind more than one, a keyframe would be outdated.
  const bool urgent = overlap.in_view < kPolicy.urgent_share * options_.keyframe_overlap ||
                      inliers < kPolicy.urgent_share * options_.keyframe_found * most_inliers_;
  if (unfinished_jobs > 1 && !urgent) return false;
  const bool young = static_cast<int>(map.keyframes.size()) <= young_map_keyframes_;
  const double parallax = options_.keyframe_parallax_deg / (young ? kPolicy.young_parallax_divisor : 1);
  if (overlap.parallax_deg > parallax || overlap.in_view < options_.keyframe_overlap) return true;
  // Landmarks in view are no longer found: another side, scale or light.
  return inliers < options_.keyframe_found * most_inliers_ &&
         overlap.parallax_deg > kPolicy.least_parallax_share * parallax;
}

}  // namespace mono_pose_tracker
