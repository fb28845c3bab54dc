#include "fixed_keyframes.h"

#include <algorithm>
#include <map>
#include <utility>

namespace mono_pose_tracker {

std::vector<KeyframeId> fixed_keyframes(const Map& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& free, int max_fixed) {
  std::map<KeyframeId, int> count;
  for (const LandmarkId l : landmarks) {
    for (const Observation& o : map.landmark(l)->observations) ++count[o.keyframe];
  }
  for (const KeyframeId id : free) count.erase(id);
  std::vector<std::pair<int, KeyframeId>> order;
  for (const auto& [id, n] : count) order.emplace_back(-n, id);
  std::sort(order.begin(), order.end());
  std::vector<KeyframeId> fixed;
  for (const auto& entry : order) {
    if (static_cast<int>(fixed.size()) < max_fixed) fixed.push_back(entry.second);
  }
  std::sort(fixed.begin(), fixed.end());
  return fixed;
}

}  // namespace mono_pose_tracker
