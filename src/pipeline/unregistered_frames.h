#pragma once

#include <cstddef>
#include <cstdint>
#include <set>

namespace mono_pose_tracker {

// The frames of a recording of this length that are not in `registered`.
std::set<std::int64_t> frames_without_pose(const std::set<std::int64_t>& registered,
                                           std::int64_t frames_total);

// At most `most` of the frames: those nearest to a registered one; of equals, the earlier ones.
std::set<std::int64_t> nearest_to_registered(const std::set<std::int64_t>& frames,
                                             const std::set<std::int64_t>& registered, std::size_t most);

}  // namespace mono_pose_tracker
