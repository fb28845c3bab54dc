#pragma once

#include <unordered_set>
#include <utility>
#include <vector>

#include "mapping/pose_support.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

struct KeyframeLocatorOptions {
  int local_keyframes = 12;  // whose landmarks verify the pose: the place and those that share most with it
  PoseSupportOptions support;
};

/// The pose of an image in a map in which it was not registered.
struct Location {
  bool found = false;
  Rigid3 camera_from_map;
  std::vector<std::pair<int, LandmarkId>> matches;  // feature, landmark: the inliers
  PoseSupport support;
};

/// Registers an image at one place of a map (a keyframe and its covisible keyframes): descriptor matching,
/// P3P RANSAC, guided matching, refinement. `found` means that the pose is supported (pose_support.h);
/// callers should require a second consistent view. excluded: landmarks that are not used.
Location locate(const MapperOptions& options, const Map& map, KeyframeId place, const ImageFeatures& image,
                const std::unordered_set<LandmarkId>& excluded = {},
                const KeyframeLocatorOptions& locator = {});

}  // namespace mono_pose_tracker
