#pragma once

#include <cerrno>
#include <string>
#include <system_error>

namespace mono_pose_tracker {

/// What errno stands for, in words; of 0, since not all that fails sets it: "unknown reason". Set it to 0
/// before what may fail. (std::strerror is not for several threads.)
inline std::string system_error_text(int error = errno) {
  return error ? std::generic_category().message(error) : "unknown reason";
}

}  // namespace mono_pose_tracker
