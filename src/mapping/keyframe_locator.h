#pragma once

#include <utility>
#include <vector>

#include "mapping/pose_support.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Where an image stands in a map it was not posed in.
struct Location {
  bool found = false;
  Rigid3 camera_from_map;
  std::vector<std::pair<int, LandmarkId>> matches;  // feature, landmark: the inliers
  PoseSupport support;
};

/// Looks for an image at one place of a map (a keyframe and those that share view with it): descriptors, P3P
/// RANSAC, guided matching, refinement. Found means supported (pose_support.h); a second view should agree
/// before anything is made of it.
Location locate(const MapperOptions& options, const Map& map, KeyframeId place, const ImageFeatures& image);

}  // namespace mono_pose_tracker
