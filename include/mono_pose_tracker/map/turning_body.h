#pragma once

#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// Which features of an image are a body's that turns before the camera, and which are of what moves
/// otherwise: one flag a feature, of what is unknown neither.
struct TurningBody {
  ImageFeaturesPtr image;
  std::vector<char> turns, moves_otherwise;
};

}  // namespace mono_pose_tracker
