#pragma once

#include <cstddef>

#include "mono_pose_tracker/map/map.h"
#include "quality/scale_cut.h"

namespace mono_pose_tracker {

/// Precision of the camera path: its positional uncertainty from image noise, compared with its length. Far
/// points that hardly show the camera's translation, or few points between places, constrain the path weakly:
/// many paths fit about as well. All in the map's unit.
struct PathPrecision {
  double sigma = 0;   // of a keyframe's position, root mean square; infinite where unconstrained
  double length = 0;  // from keyframe to keyframe in the order of time
  double extent = 0;  // of the keyframes about their centroid, root mean square
  ScaleCut weakest_cut;

  double share() const;  // of the length; infinite for a path without a length
};

/// Computed from the joint covariance of all keyframes, in the frame and unit of their mean orientation,
/// centroid and extent (optimization/map_adjustment.h). The time grows with the third power of the
/// number of keyframes: 300 take three seconds. More than most_keyframes are evaluated in parts, in the order
/// of time: sigma is that of the least certain part, without what the others know of it.
PathPrecision path_precision(const Map& map, std::size_t most_keyframes = 300);

}  // namespace mono_pose_tracker
