#pragma once

#include <shared_mutex>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/place_index.h"

namespace mono_pose_tracker {

// The place index of a map. The mapper keeps it up to date; any thread with a snapshot may query it.
class KeyframePlaces : public PlaceFinder {
 public:
  std::vector<KeyframeId> find(const FeatureSet& features, int count) const override;

  // Adds new keyframes to the index and drops removed ones.
  void follow(const Map& map);
  // Only for the mapper's thread.
  const PlaceIndex& index() const { return index_; }

 private:
  mutable std::shared_mutex mutex_;  // guards index_; the mapper alone changes it
  PlaceIndex index_;
  std::vector<KeyframeId> known_;  // the mapper's; ascending
};

}  // namespace mono_pose_tracker
