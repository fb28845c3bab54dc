#pragma once

#include <string>

namespace mono_pose_tracker {

/// The full path: a leading ~ becomes the home folder, package://PACKAGE/ the package's folder, file:// is
/// taken off, and a relative path begins in the working folder (of a node that roslaunch started: ~/.ros).
/// Throws std::runtime_error when there is no such package.
std::string expand_path(const std::string& path);

/// An error text if these two path parameters, as given by the user, refer to one file; empty otherwise.
std::string one_file_problem(const std::string& parameter, const std::string& path,
                             const std::string& other_parameter, const std::string& other_path);

}  // namespace mono_pose_tracker
