#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {

// Those of the indices below count that are usable, in a seeded random order.
template <class IsUsable>
std::vector<int> shuffled_indices(std::size_t count, std::uint64_t seed, const IsUsable& is_usable) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < count; ++i) {
    if (is_usable(i)) indices.push_back(static_cast<int>(i));
  }
  Random random(seed);
  for (int i = static_cast<int>(indices.size()) - 1; i > 0; --i) {
    std::swap(indices[i], indices[random.index(static_cast<std::uint32_t>(i + 1))]);
  }
  return indices;
}

}  // namespace mono_pose_tracker
