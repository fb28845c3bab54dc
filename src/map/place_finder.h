#pragma once

#include <vector>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Number of candidates from place recognition. In 95 % of the cases a correct one is among them, if there is
/// one.
constexpr int kBestPlaces = 5;

/// Finds keyframes with a similar appearance. May be called from any thread while the map grows: the result
/// may be newer than a snapshot, or removed from the map since.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  /// At most `count` keyframes, the most similar first.
  virtual std::vector<KeyframeId> find(const FeatureSet& features, int count) const = 0;
};

}  // namespace mono_pose_tracker
