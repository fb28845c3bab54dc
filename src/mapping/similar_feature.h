#pragma once

#include <cstdint>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Whether a feature like the landmark's is where the landmark should be: then a match that lies elsewhere is
// one of those that a repeated pattern gives, and says nothing.
inline bool has_similar_feature_at(const ImageFeatures& image, const std::uint8_t* descriptor,
                                   const Eigen::Vector3d& x_in_camera, double limit_px) {
  constexpr double kMostApart = 0.6;  // of unit descriptors, as for an observation to its landmark
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
