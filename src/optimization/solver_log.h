#pragma once

namespace mono_pose_tracker {

// Ceres warns through glog of every step that it then takes back, on standard error unless the program has
// set glog up; SILENT does not reach these lines. A solve that fails is known from its report: below errors,
// glog is told to say nothing, once in a process that has not chosen a level itself.
void silence_solver_log();

}  // namespace mono_pose_tracker
