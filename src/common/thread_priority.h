#pragma once

namespace mono_pose_tracker {

/// Lowers the priority of the calling thread by this many steps of niceness and limits its time slice to 0.1
/// ms while others wait (Linux 6.12 or newer). Does nothing where the system refuses.
void lower_thread_priority(int steps);

}  // namespace mono_pose_tracker
