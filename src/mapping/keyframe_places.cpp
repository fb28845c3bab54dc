#include "keyframe_places.h"

#include <algorithm>
#include <iterator>
#include <mutex>

namespace mono_pose_tracker {

std::vector<KeyframeId> KeyframePlaces::find(const FeatureSet& features, int count) const {
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  std::vector<KeyframeId> ids;
  for (const PlaceMatch& match : index_.query(features, count)) ids.push_back(match.id);
  return ids;
}

// Keyframe ids grow with time. The newest ids and the number of keyframes show what has changed; all
// keyframes are visited only when one was removed.
void KeyframePlaces::follow(const Map& map) {
  const auto& keyframes = map.keyframes();
  auto is_new = keyframes.rbegin();
  while (is_new != keyframes.rend() && (known_.empty() || is_new->first > known_.back())) ++is_new;
  for (auto added = is_new.base(); added != keyframes.end(); ++added) {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.add(added->first, added->second.image->set);
    known_.push_back(added->first);
  }
  if (known_.size() == keyframes.size()) return;
  const auto is_gone = [&](KeyframeId id) {
    if (map.keyframe(id)) return false;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.remove(id);
    return true;
  };
  known_.erase(std::remove_if(known_.begin(), known_.end(), is_gone), known_.end());
}

}  // namespace mono_pose_tracker
