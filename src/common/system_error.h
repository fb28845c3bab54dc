#pragma once

#include <cerrno>
#include <string>
#include <system_error>

namespace mono_pose_tracker {

/// The text of an errno value; "unknown reason" for 0. Not every failing call sets errno, so set it to 0
/// before the call. (std::strerror is not thread-safe.)
inline std::string system_error_text(int error = errno) {
  return error ? std::generic_category().message(error) : "unknown reason";
}

}  // namespace mono_pose_tracker
