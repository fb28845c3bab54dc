#pragma once

#include <algorithm>
#include <vector>

namespace mono_pose_tracker {

// The values in ascending order without duplicates.
template <typename T>
std::vector<T> sorted_unique(std::vector<T> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

}  // namespace mono_pose_tracker
