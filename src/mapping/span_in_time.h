#pragma once

#include <cstddef>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Of a landmark's keyframes, in the order of time, the second and the last but one, as places in that order.
// Wherever time is cut between these two, two keyframes on either side see the landmark: it has a depth on
// both, and ties them.
struct SpanInTime {
  std::size_t second = 0, last_but_one = 0;

  bool ties(std::size_t before, std::size_t after) const { return second < before && last_but_one >= after; }
};

// Of all landmarks that at least four keyframes see. in_time: the map's keyframes, in the order of time.
std::vector<SpanInTime> spans_in_time(const Map& map, const std::vector<const Keyframe*>& in_time);

}  // namespace mono_pose_tracker
