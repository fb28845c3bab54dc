#pragma once

#include <cstdint>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How uncertain the ratio of path lengths before and after a moment of the recording is.
struct ScaleCut {
  std::int64_t frame_index = 0;  // of the first keyframe after the cut
  int landmarks = 0;             // observed on both sides
  double log_scale_sigma = 0;    // standard deviation of log(length after / length before); infinite: unknown
  double path_share = 0;         // of the path, on the shorter side; in [0, 0.5]

  /// Standard deviation of the position error that the cut adds, relative to the path.
  double path_sigma() const;
};

/// Precision of the camera path: its positional uncertainty from image noise, compared with its length. Far
/// points that hardly show the camera's translation, or few points between places, constrain the path weakly:
/// many paths fit about as well. All in the map's unit.
struct PathPrecision {
  double sigma = 0;   // of a keyframe's position, root mean square; infinite where unconstrained
  double length = 0;  // from keyframe to keyframe in the order of time
  double extent = 0;  // of the keyframes about their centroid, root mean square
  ScaleCut weakest;   // the temporal cut with the largest path_sigma

  double share() const;  // of the length; infinite for a path without a length
};

/// Computed from the joint covariance of all keyframes, in the frame and unit of their mean orientation,
/// centroid and extent (optimization/map_adjustment.h). The time grows with the third power of the
/// number of keyframes. More than 300 are evaluated in parts, in the order of time, each of which overlaps
/// with half of the next: sigma is that of the least certain part, without what the others know of it.
PathPrecision path_precision(const Map& map);

}  // namespace mono_pose_tracker
