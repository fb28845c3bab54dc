#pragma once

#include <vector>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Of the places that look most like an image: among so many is a right one, where there is one, in 95 of 100
/// cases.
constexpr int kBestPlaces = 5;

/// Finds keyframes that look like an image. May be asked from any thread while the map grows: what it finds
/// may be newer than a snapshot, or gone from the map meanwhile.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  /// `count` at most, the most alike first.
  virtual std::vector<KeyframeId> find(const FeatureSet& features, int count) const = 0;
};

}  // namespace mono_pose_tracker
