#include "span_in_time.h"

#include <algorithm>
#include <unordered_map>

namespace mono_pose_tracker {

std::vector<SpanInTime> spans_in_time(const Map& map, const std::vector<const Keyframe*>& in_time) {
  constexpr std::size_t kTwoOnEachSide = 4;
  std::unordered_map<KeyframeId, std::size_t> place_of;
  for (std::size_t i = 0; i < in_time.size(); ++i) place_of[in_time[i]->id] = i;
  std::vector<SpanInTime> spans;
  std::vector<std::size_t> places;
  for (const auto& entry : map.landmarks()) {
    if (entry.second.observations.size() < kTwoOnEachSide) continue;
    places.clear();
    for (const Observation& o : entry.second.observations) places.push_back(place_of.at(o.keyframe));
    std::sort(places.begin(), places.end());
    spans.push_back({places[1], places[places.size() - 2]});
  }
  return spans;
}

}  // namespace mono_pose_tracker
