#pragma once

#include <algorithm>
#include <vector>

namespace mono_pose_tracker {

// The ids in order, each once.
template <typename Id>
std::vector<Id> sorted_unique(std::vector<Id> ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace mono_pose_tracker
