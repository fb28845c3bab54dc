#pragma once

#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct EpipolarMatchOptions {
  double max_error_rad = 0.004;    // from bearing to epipolar plane
  int max_distance2 = 0;           // of the descriptors
  double min_ratio = 1.25;         // second nearest over nearest, among those near the epipolar line
  double max_scale_ratio = 3;      // of the two features: 1.6 octaves
  double max_chance_share = 0.2;   // of the matches; bundle adjustment and culling bear as many
  int threads = 1;                 // the result is the same for any number
  CancelFlag cancelled = nullptr;  // once it is set: no matches
};

// Guided matching (paper, step 4c) between features of two keyframes that see no landmark yet: only features
// near the epipolar line are compared, and the nearest must be mutual. What looks less alike than chance does
// is left out: a strip beside the line tells how many matches chance gives (target and decoy, as peptides are
// told: Elias and Gygi, Nature Methods 2007). Where the relative pose is wrong that is all of them.
std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options);

}  // namespace mono_pose_tracker
