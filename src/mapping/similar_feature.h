#pragma once

#include <cstdint>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Whether the image has a similar feature where the landmark projects. A match elsewhere is then due to
// repeated structure and is no evidence of an inconsistency.
inline bool has_similar_feature_at(const ImageFeatures& image, const std::uint8_t* descriptor,
                                   const Eigen::Vector3d& x_in_camera, double limit_px) {
  constexpr double kMostApart =
      0.6;  // distance of unit descriptors, as between an observation and its landmark
  for (int f = 0; f < image.size(); ++f) {
    if (image.set.bearings[f].dot(x_in_camera) <= 0 ||
        reprojection_error(image, f, x_in_camera).norm() > limit_px) {
      continue;
    }
    if (descriptor_distance2(descriptor, image.set.descriptor(f)) < stored_distance2(kMostApart)) return true;
  }
  return false;
}

}  // namespace mono_pose_tracker
