#pragma once

#include <cstddef>
#include <string>

namespace mono_pose_tracker {

/// The whole content of a file, without the byte order mark that UTF-8 may begin with. Throws
/// std::runtime_error, one line naming the path, the reason and `expected` (what the file should have been),
/// when it cannot be read or has more than max_bytes: a device never ends.
std::string read_text_file(const std::string& path, const std::string& expected, std::size_t max_bytes);

}  // namespace mono_pose_tracker
