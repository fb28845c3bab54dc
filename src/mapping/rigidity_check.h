#pragma once

#include <string>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How well the poses agree that disjoint parts of a keyframe's landmarks give: the left and the right half,
/// the upper and the lower, the near and the far, the middle and the rim. In a rigid world they differ by
/// noise.
struct RigidityReport {
  bool is_rigid = true;
  int keyframes = 0;           // that could be checked
  std::string parts;           // that disagree most, such as "left and right"
  double mahalanobis2 = 0;     // of them, in the worst stretch of keyframes: the median; 6 degrees of freedom
  double disagreement_px = 0;  // the same: how far apart the two poses see the landmarks
  std::int64_t frame_index = -1;  // where that stretch begins
};

struct RigidityOptions {
  int stretch = 10;        // keyframes in a row whose median counts: one may be blurred or badly matched
  int newest = 0;          // only so many of the newest keyframes are asked; 0: all
  int min_keyframes = 4;   // fewer in a map: nothing can be said
  int min_landmarks = 20;  // of a part
  // Below this a disagreement is what a calibration and a lens model leave over, however significant many
  // landmarks make it.
  double min_disagreement_px = 1.5;  // at 640 px (image_scale)
};

/// A pure function of the map. Poses are refined from each part alone, the landmarks fixed; the distance of
/// the two is in units of both covariances, and these are scaled by what parts chosen at random disagree by:
/// noise of the landmarks is in both. Not rigid: p < 1e-3 and the disagreement can be seen in px.
RigidityReport check_rigidity(const Map& map, const RigidityOptions& options = {});

}  // namespace mono_pose_tracker
