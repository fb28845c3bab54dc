#pragma once

#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct EpipolarMatchOptions {
  double max_error_rad = 0.004;   // angle between bearing and epipolar plane
  int max_distance2 = 0;          // of the descriptors
  double min_ratio = 1.25;        // second nearest over nearest, among the features near the epipolar line
  double max_scale_ratio = 3;     // of the two features: 1.6 octaves
  double max_chance_share = 0.2;  // of accidental matches; bundle adjustment and culling tolerate this share
  // Distance from the epipolar line to the centre of the decoy strip, in half widths. Features three half
  // widths off are no matches, whatever the errors of the poses.
  float decoy_strip = 4;
  int threads = 1;                 // the result is the same for any number
  CancelFlag cancelled = nullptr;  // once set, no matches are returned
};

// Guided matching (paper, step 4c) between features of two keyframes that have no landmark yet. Only features
// near the epipolar line are compared, and matches must be mutual nearest neighbours. A decoy strip next to
// the line estimates the number of accidental matches at each descriptor distance (target-decoy search, Elias
// and Gygi, Nature Methods 2007). Matches above the distance at which accidental ones are too frequent are
// excluded; with a wrong relative pose that is all of them.
std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options);

}  // namespace mono_pose_tracker
