#pragma once

#include <cstdint>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Keyframes that only far things tie to the others have a size of their own, cameras and what is near them
/// together. Where what ties them is wrong by so much that the best size would be negative, adjusting the map
/// shrinks it to nothing: the cameras stand in one place, what is near lies at their lenses, and nothing in
/// the images speaks against it.
struct ScaleCollapse {
  std::int64_t frame_index = -1;  // of the keyframe where it shows most; -1: nowhere
  int landmarks = 0;              // that the keyframe sees
  int near = 0;                   // of them: at its lens

  /// As a share of the median distance. A hand before a skyline is at a hundredth or a thousandth of it. This
  /// is a millimetre before a wall 10 m away, where no lens can see anything.
  static constexpr double kNearest = 1e-4;
  /// Fewer may be wrong matches.
  static constexpr int kMinNear = 5;
  bool is_significant() const { return near >= kMinNear; }
};

ScaleCollapse worst_scale_collapse(const Map& map);

}  // namespace mono_pose_tracker
