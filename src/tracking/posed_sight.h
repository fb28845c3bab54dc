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

// Whether two images show that the camera went from the one pose to the other: what each shows of the map is
// found in the other, by descriptors alone, where the other's pose has it. Where one of them was posed at a
// place that only looks like its own, it lies elsewhere or should not be in view.
bool show_the_way(const PosedSight& a, const PosedSight& b, const MatchOptions& matching);

}  // namespace mono_pose_tracker
