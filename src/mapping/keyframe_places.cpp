#include "keyframe_places.h"

#include <mutex>

namespace mono_pose_tracker {

std::vector<KeyframeId> KeyframePlaces::find(const FeatureSet& features, int count) const {
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  std::vector<KeyframeId> ids;
  for (const PlaceMatch& match : index_.query(features, count)) ids.push_back(match.id);
  return ids;
}

void KeyframePlaces::follow(const Map& map) {
  for (auto known = known_.begin(); known != known_.end();) {
    if (map.keyframe(*known)) {
      ++known;
      continue;
    }
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.remove(*known);
    known = known_.erase(known);
  }
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (!known_.insert(id).second) continue;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.add(id, keyframe.image->set);
  }
}

}  // namespace mono_pose_tracker
