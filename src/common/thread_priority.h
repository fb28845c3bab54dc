#pragma once

namespace mono_pose_tracker {

/// Lowers the priority of the calling thread by so many steps of niceness, and lets it run for a tenth of a
/// millisecond at a time while others wait (Linux 6.12 or newer). Does nothing where the system refuses.
void lower_thread_priority(int steps);

}  // namespace mono_pose_tracker
