#pragma once

#include <atomic>

namespace mono_pose_tracker {

/// Another thread sets it once nobody waits for the result any more: the work then ends soon, with less than
/// was asked for. Null: never.
using CancelFlag = const std::atomic<bool>*;

inline bool is_set(CancelFlag flag) { return flag && flag->load(std::memory_order_relaxed); }

}  // namespace mono_pose_tracker
