#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How well the images know the way along which they were taken: what their noise leaves open of it, beside
/// its length. What is seen from so far away that the images hardly show that the camera moved, or by so few
/// points that they hardly hold its places together, fits many ways about as well, and the best is a matter
/// of chance. All in the map's unit.
struct PathPrecision {
  double sigma = 0;   // of a keyframe's position, root mean square; infinite where nothing tells it
  double length = 0;  // from keyframe to keyframe in the order of time
  double extent = 0;  // of the keyframes about their middle, root mean square

  double share() const;

  /// Three standard deviations are 3 % of the way then. Of right maps of whole recordings a thousandth.
  static constexpr double kMostShare = 0.01;
  /// Of the extent: a camera that stands still goes to and fro by noise, a long way in the end, but no
  /// farther than a sigma or two.
  static constexpr double kMostOfExtent = 0.2;
  double uncertainty() const;  // of what it may be
  bool is_known() const { return uncertainty() <= 1; }
};

/// By the covariances of all keyframes at once, in the frame and unit of their mean orientation, middle and
/// extent (optimization/keyframe_covariance.h). The time grows with the third power of their number: more
/// than 300 are asked in parts, in the order of time, and the middle one of these counts (of two, the
/// better), as one may be held together by the others alone.
PathPrecision path_precision(const Map& map);

}  // namespace mono_pose_tracker
