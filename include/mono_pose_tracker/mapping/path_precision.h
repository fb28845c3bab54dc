#pragma once

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How well the images know the way along which they were taken: what their noise leaves open of it, beside
/// its length. What is seen from so far away that the images hardly show that the camera moved, or by so few
/// points that they hardly hold its places together, fits many ways about as well, and the best is a matter
/// of chance.
struct PathPrecision {
  double sigma = 0;   // of a keyframe's position, root mean square; infinite where nothing tells it
  double length = 0;  // from keyframe to keyframe, in the order of time; both in the map's unit

  double share() const;

  /// Three standard deviations are 3 % of the way then. Of right maps of whole recordings a thousandth.
  static constexpr double kMostShare = 0.01;
  bool is_known() const { return share() <= kMostShare; }
};

/// By the covariances of all keyframes at once, whatever similarity of them all left aside
/// (optimization/keyframe_covariance.h). Of more than two hundred keyframes: of as few stretches as will do,
/// each by itself, as if their errors were independent, which are less than those of the whole.
PathPrecision path_precision(const Map& map);

}  // namespace mono_pose_tracker
