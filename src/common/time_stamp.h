#pragma once

#include <cstdint>

namespace mono_pose_tracker {

/// Stamps are nanoseconds, no farther from 0 than this (146 years), so that any two may be subtracted.
/// Whoever reads one from outside checks it.
constexpr std::int64_t kMaxStampNs = (std::int64_t{1} << 62) - 1;

inline bool is_stamp(std::int64_t stamp_ns) { return stamp_ns >= -kMaxStampNs && stamp_ns <= kMaxStampNs; }

/// From one stamp to the other.
inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

}  // namespace mono_pose_tracker
