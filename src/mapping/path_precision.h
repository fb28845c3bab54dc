#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Precision of the camera path: its positional uncertainty from image noise, compared with its length. Far
/// points that hardly show the camera's translation, or few points between places, constrain the path weakly:
/// many paths fit about as well. All in the map's unit.
struct PathPrecision {
  double sigma = 0;   // of a keyframe's position, root mean square; infinite where unconstrained
  double length = 0;  // from keyframe to keyframe in the order of time
  double extent = 0;  // of the keyframes about their centroid, root mean square

  double share() const;

  /// Three standard deviations are then 3 % of the path length. Right maps of whole recordings have a
  /// thousandth.
  static constexpr double kMostShare = 0.01;
  /// Share of the extent. Noise moves a standing camera back and forth: the path gets long, but stays within
  /// a sigma or two.
  static constexpr double kMostOfExtent = 0.2;
  double uncertainty() const;  // relative to the limit
  bool is_known() const { return uncertainty() <= 1; }
};

/// Computed from the joint covariance of all keyframes, in the frame and unit of their mean orientation,
/// centroid and extent (optimization/keyframe_covariance.h). The time grows with the third power of the
/// number of keyframes. More than 300 are evaluated in parts, in the order of time. The middle part counts
/// (of two, the more precise), as one part may be constrained only by the others.
PathPrecision path_precision(const Map& map);

}  // namespace mono_pose_tracker
