#pragma once

#include <atomic>

namespace mono_pose_tracker {

/// Another thread sets the flag when the result is no longer needed. The work then ends soon, with a partial
/// result. Null: the work cannot be cancelled.
using CancelFlag = const std::atomic<bool>*;

inline bool is_set(CancelFlag flag) { return flag && flag->load(std::memory_order_relaxed); }

}  // namespace mono_pose_tracker
