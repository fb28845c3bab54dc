#pragma once

namespace mono_pose_tracker {

/// Lowers the priority of the calling thread by so many steps of niceness. Does nothing where the system
/// refuses.
void lower_thread_priority(int steps);

}  // namespace mono_pose_tracker
