#pragma once

#include <string>

namespace mono_pose_tracker {

/// The main of a node that loads one nodelet in its own process. Returns the exit status: 0 after a shutdown,
/// 1 when the nodelet refused, 2 when it could not be loaded.
int run_nodelet(const std::string& type, const std::string& default_name, int argc, char** argv);

}  // namespace mono_pose_tracker
