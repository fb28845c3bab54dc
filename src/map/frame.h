#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// One image on its way through the tracker.
struct Frame {
  std::int64_t index = 0;  // counts the images
  std::int64_t stamp_ns = 0;
  ImageFeaturesPtr image;
  std::vector<Eigen::Vector3d> marker =
      {};                               // bearings of the corners of the marker that sets the scale, if seen
  bool is_masked = false;               // features were excluded by a mask
  bool is_of_object = false;            // all those of what is behind it, which was found by its motion
  bool is_mask_given = false;           // by whoever wants the object, not found in the image
  ImageFeaturesPtr unmasked = nullptr;  // with the features excluded as another object's; null: none were

  /// Keeps only these features, those of the object found by its motion.
  void keep_masked_features(ImageFeaturesPtr of_object) {
    image = std::move(of_object);
    is_masked = is_of_object = true;
    is_mask_given = false;
  }
};

/// Feature `feature` of the frame observes the landmark.
struct FrameObservation {
  int feature = -1;
  LandmarkId landmark = kNoLandmark;
};

}  // namespace mono_pose_tracker
