#pragma once

#include <cstddef>
#include <cstdint>
#include <set>

namespace mono_pose_tracker {

// Of a recording of so many images, those that are not in `posed`.
std::set<std::int64_t> frames_without_pose(const std::set<std::int64_t>& registered,
                                           std::int64_t frames_total);

// So many of these at most, those nearest to a frame that has a pose; of equals, the earlier ones.
std::set<std::int64_t> nearest_to_registered(const std::set<std::int64_t>& frames,
                                             const std::set<std::int64_t>& registered, std::size_t most);

}  // namespace mono_pose_tracker
