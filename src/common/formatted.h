#pragma once

#include <string>

namespace mono_pose_tracker {

/// As std::printf writes it, however long; the compiler checks the arguments.
std::string formatted(const char* format, ...) __attribute__((format(printf, 1, 2)));

}  // namespace mono_pose_tracker
