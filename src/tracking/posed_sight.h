#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// What an image shows of the map from where it is posed.
struct PosedSight {
  Rigid3 camera_from_map;
  ImageFeaturesPtr image;
  std::vector<int> features;            // that see
  std::vector<Eigen::Vector3d> points;  // these, in the map
};

// Whether two images show that the camera went from the one pose to the other.
enum class WayShown {
  kNot,    // what one of them shows of the map lies elsewhere in the other, or should not be in view, or is
           // little
  kAgree,  // it lies where the other's pose has it, but from the first pose most of it would as well
  kShown,
};

// By descriptors alone, both ways. An image that was posed at a place that only looks like its own does not
// agree.
WayShown way_shown(const PosedSight& a, const PosedSight& b, const MatchOptions& matching);

}  // namespace mono_pose_tracker
