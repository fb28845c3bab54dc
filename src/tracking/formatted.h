#pragma once

#include <cstdio>
#include <string>

namespace mono_pose_tracker {

// As std::snprintf writes it, up to 255 characters.
template <typename... Args>
std::string formatted(const char* format, Args... args) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

}  // namespace mono_pose_tracker
