#pragma once

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Displacement of a matched feature between the images, px at 640 px (image_scale).
inline double shift_px(const ImageFeatures& first, const ImageFeatures& second, const Match& m) {
  return (second.set.features[m.second].pixel - first.set.features[m.first].pixel).norm() /
         image_scale(first.camera);
}

}  // namespace mono_pose_tracker
