#pragma once

namespace mono_pose_tracker {

/// The calling thread lets others of the machine go first, by so many steps of niceness more than it does
/// already. Where that cannot be told to the system nothing happens.
void lower_thread_priority(int steps);

}  // namespace mono_pose_tracker
