#include "most_observed_landmarks.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

namespace mono_pose_tracker {

std::vector<LandmarkId> most_observed_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                int max_of_keyframe) {
  std::set<LandmarkId> chosen;
  for (const KeyframeId id : keyframes) {
    std::vector<std::pair<int, LandmarkId>> order;
    for (const LandmarkId l : map.keyframe(id)->landmark_of_feature) {
      if (l == kNoLandmark) continue;
      const auto views = static_cast<int>(map.landmark(l)->observations.size());
      if (views >= 2) order.emplace_back(-views, l);
    }
    const auto count = std::min<std::size_t>(order.size(), static_cast<std::size_t>(max_of_keyframe));
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());
    for (std::size_t i = 0; i < count; ++i) chosen.insert(order[i].second);
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace mono_pose_tracker
