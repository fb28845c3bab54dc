#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// Motion of a feature: it is on the object that turns before the camera, or it moves independently of it.
enum class FeatureMotion : std::uint8_t { kUnknown, kTurns, kMovesOtherwise };

/// The features of an image that are on an object turning before the camera; one entry per feature.
struct TurningObject {
  ImageFeaturesPtr image;
  std::vector<FeatureMotion> sides;
};

}  // namespace mono_pose_tracker
