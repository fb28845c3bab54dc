#pragma once

#include <iterator>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Whether a keyframe of a map of two or more stays where it is, whatever speaks against it: one of the first
// two, by which the map has its frame, or of an earlier run.
inline bool is_held(const Map& map, const Keyframe& keyframe) {
  const auto first = map.keyframes().begin();
  return is_of_earlier_run(keyframe.frame_index) || keyframe.id == first->first ||
         keyframe.id == std::next(first)->first;
}

}  // namespace mono_pose_tracker
