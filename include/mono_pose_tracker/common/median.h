#pragma once

#include <algorithm>
#include <vector>

namespace mono_pose_tracker {

/// The upper median; 0 of nothing.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

}  // namespace mono_pose_tracker
