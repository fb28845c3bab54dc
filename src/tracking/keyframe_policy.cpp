#include "keyframe_policy.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/geometry/triangulation.h"

namespace mono_pose_tracker {

Overlap overlap_with(const TrackingMap& map, KeyframeId id, const ResectionReport& resection,
                     const CameraModel& camera) {
  Overlap overlap;
  const KeyframeView& keyframe = map.keyframes.at(id);
  const Eigen::Vector3d there = keyframe.camera_from_map.inverse().translation;
  const Eigen::Vector3d here = resection.camera_from_map.inverse().translation;
  std::vector<double> angles;
  for (const FrameObservation& o : resection.observations) {
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
    in_view += camera.project(resection.camera_from_map * landmark->second, &pixel) && camera.in_image(pixel);
  }
  if (landmarks > 0) overlap.in_view = static_cast<double>(in_view) / landmarks;
  return overlap;
}

bool KeyframePolicy::is_due(const TrackingMap& map, const Overlap& overlap, int inliers, int backlog) {
  const KeyframeId newest = map.keyframes.rbegin()->first;
  if (newest != newest_keyframe_) most_inliers_ = 0;
  newest_keyframe_ = newest;
  most_inliers_ = std::max(most_inliers_, inliers);
  // One may wait. With more, until they are in the map the next would tell it little - unless the view is
  // about to leave what the map knows.
  const bool urgent = overlap.in_view < 0.5 * options_.keyframe_overlap ||
                      inliers < 0.5 * options_.keyframe_found * most_inliers_;
  if (backlog > 1 && !urgent) return false;
  // A young map's points were made from little parallax: it wants more views early.
  const bool young = static_cast<int>(map.keyframes.size()) <= young_map_keyframes_;
  const double parallax = options_.keyframe_parallax_deg / (young ? 3 : 1);
  if (overlap.parallax_deg > parallax || overlap.in_view < options_.keyframe_overlap) return true;
  // Landmarks are found no more though they are in view: another side, another scale or light. Below a tenth
  // of the parallax a new view of them would add nothing.
  return inliers < options_.keyframe_found * most_inliers_ && overlap.parallax_deg > 0.1 * parallax;
}

}  // namespace mono_pose_tracker
