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
  double disagreement_px = 0;     // median distance in the image between the landmarks under the two poses
  std::int64_t frame_index = -1;  // where that stretch begins
};

struct RigidityOptions {
  int stretch = 10;        // keyframes in a row whose median counts: one may be blurred or badly matched
  int newest = 0;          // check only this number of newest keyframes; 0: all
  int min_keyframes = 4;   // maps with fewer are not checked
  int min_landmarks = 20;  // of a part
  // Smaller disagreements are within the errors of calibration and lens model, even if they are significant.
  double min_disagreement_px = 1.5;  // at 640 px (image_scale)
};

/// A pure function of the map. Refines a pose from each part alone, with fixed landmarks. The difference of
/// two poses is measured in units of their covariances, scaled by the disagreement of randomly chosen parts,
/// since landmark noise affects both. Not rigid: p < 1e-3 and a disagreement of at least min_disagreement_px.
RigidityReport check_rigidity(const Map& map, const RigidityOptions& options = {});

}  // namespace mono_pose_tracker
