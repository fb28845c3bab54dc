#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// How far the feature is from where the keyframe would see the point, px, weighed as bundle adjustment does.
inline double error_px(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map) {
  return weighted_error(*keyframe.image, feature, keyframe.camera_from_map * x_in_map);
}

// Those that the keyframe sees, by feature.
inline std::vector<LandmarkId> landmarks_of(const Keyframe& keyframe) {
  std::vector<LandmarkId> ids;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    if (l != kNoLandmark) ids.push_back(l);
  }
  return ids;
}

}  // namespace mono_pose_tracker
