#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// What a feature is of: a body that turns before the camera, or what moves otherwise.
enum class FeatureMotion : std::uint8_t { kUnknown, kTurns, kMovesOtherwise };

/// Which features of an image are of a body that turns before the camera, one side a feature.
struct TurningObject {
  ImageFeaturesPtr image;
  std::vector<FeatureMotion> sides;
};

}  // namespace mono_pose_tracker
