#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// The voters, each with its distance.
using DistantVotes = std::vector<std::pair<float, bool>>;

/// Whether the majority of the nearest voters says yes; false without voters.
inline bool most_of_nearest(std::size_t voters, DistantVotes votes) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(voters, votes.size()));
  std::partial_sort(votes.begin(), votes.begin() + count, votes.end());
  return 2 * std::count_if(votes.begin(), votes.begin() + count, [](const auto& v) { return v.second; }) >
         count;
}

}  // namespace mono_pose_tracker
