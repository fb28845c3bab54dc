#pragma once

#include <string>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Compares the poses from disjoint parts of a keyframe's landmarks: left and right half, upper and lower,
/// near and far, centre and rim. In a rigid world they differ only by noise.
struct RigidityReport {
  bool is_rigid = true;
  int keyframes = 0;              // number of checked keyframes
  std::string parts;              // the parts that disagree most, such as "left and right"
  double mahalanobis2 = 0;        // their median in the worst stretch of keyframes; 6 degrees of freedom
  double p_value = 1;             // of that in a rigid world, over all stretches and parts
  double disagreement_px = 0;     // median distance in the image between the landmarks under the two poses
  std::int64_t frame_index = -1;  // where that stretch begins
};

struct RigidityOptions {
  int stretch = 10;            // keyframes in a row whose median counts: one may be blurred or badly matched
  int newest = 0;              // check only this number of newest keyframes; 0: all
  int min_keyframes = 4;       // maps with fewer are not checked
  int min_landmarks = 20;      // of a part
  double significance = 1e-3;  // expected false alarms a map
  // Smaller disagreements are within the errors of calibration and lens model, even if they are significant.
  double min_disagreement_px = 1.5;  // at 640 px (image_scale)
};

/// A pure function of the map. Refines a pose from each part alone, with fixed landmarks. The difference of
/// two poses is measured in units of their covariances, scaled by the disagreement of randomly chosen parts,
/// since landmark noise affects both. Keyframes of a stretch share landmarks and errors, so that their median
/// is taken as one sample (chi-squared, 6 degrees of freedom); stretches that do not overlap, and kinds of
/// parts, are independent tests (Bonferroni). Not rigid: below the significance, and a disagreement of at
/// least min_disagreement_px.
RigidityReport check_rigidity(const Map& map, const RigidityOptions& options = {});

}  // namespace mono_pose_tracker
