#pragma once

namespace mono_pose_tracker {

// Ceres warns through glog about every step that it takes back, on standard error unless the program has set
// up glog; SILENT does not affect these lines. Failed solves are visible in the report. This raises glog's
// level to errors, once per process and only if the process has not chosen a level itself.
void silence_solver_log();

}  // namespace mono_pose_tracker
