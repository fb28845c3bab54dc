#pragma once

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

}  // namespace mono_pose_tracker
