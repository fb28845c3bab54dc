#pragma once

namespace mono_pose_tracker {

/// Resident memory of this process in MB (2^20 bytes), as Linux counts it; 0 where /proc does not tell.
double resident_mb();

/// Largest resident memory since the start of the process or since restart_peak().
double peak_resident_mb();
void restart_peak();

/// CPU time of the calling thread, and of all threads of this process. What other programs do hardly moves
/// it.
double thread_cpu_ms();
double process_cpu_ms();

}  // namespace mono_pose_tracker
