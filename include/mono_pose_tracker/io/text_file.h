#pragma once

#include <string>

namespace mono_pose_tracker {

/// The whole content of a file. Throws std::runtime_error, one line naming the path, the reason and
/// `expected` (what the file should have been), when it cannot be read.
std::string read_text_file(const std::string& path, const std::string& expected);

}  // namespace mono_pose_tracker
