#pragma once

#include <cerrno>
#include <string>
#include <system_error>

namespace mono_pose_tracker {

/// The text of an errno value; of 0 "unknown reason", since not all that fails sets it: set errno to 0 before
/// what may fail. (std::strerror is not safe with several threads.)
inline std::string system_error_text(int error = errno) {
  return error ? std::generic_category().message(error) : "unknown reason";
}

}  // namespace mono_pose_tracker
