#pragma once

#include <cstddef>
#include <cstdint>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How uncertain the ratio of lengths before and after a moment of the recording is. Only landmarks that both
/// sides triangulate alone (two keyframes each) carry the scale across.
struct ScaleCut {
  std::int64_t frame_index = 0;  // of the first keyframe after the cut
  int landmarks = 0;             // that carry the scale
  double log_scale_sigma =
      0;                  // standard deviation of log(scale after / scale before); infinite: nothing does
  double path_share = 0;  // of the path, on the shorter side; in [0, 0.5]

  /// Standard deviation of the position error that the cut adds, relative to the path.
  double path_sigma() const { return log_scale_sigma * path_share; }
};

struct ScaleCutOptions {
  double feature_sigma_px = 0.6;  // of an observation; SIFT's, in the sense of ImageFeatures::sigma_px
  double correlation = 8;  // landmarks in one view share errors: so many tell as much as one independent one
                           // (test/tracking/pose_covariance_test.cpp)
};

/// The temporal cut with the largest path_sigma. A map of fewer than four keyframes has none: all zero.
ScaleCut weakest_scale_cut(const Map& map);

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
