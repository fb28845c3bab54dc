#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace mono_pose_tracker {

/// The value below which a share of the sorted values lies, between two of them by proportion; 0 of none.
inline double quantile_of_sorted(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  const double position = share * static_cast<double>(sorted.size() - 1);
  const std::size_t below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (position - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace mono_pose_tracker
