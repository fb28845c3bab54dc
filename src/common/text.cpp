#include "common/text.h"

#include <cstdarg>
#include <cstdio>

namespace mono_pose_tracker {

std::string formatted(const char* format, ...) {
  std::va_list arguments, for_length;
  va_start(arguments, format);
  va_copy(for_length, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, for_length);
  va_end(for_length);
  std::string text(length > 0 ? length : 0, '\0');
  // The string's own end takes the terminating zero.
  if (length > 0) std::vsnprintf(text.data(), text.size() + 1, format, arguments);
  va_end(arguments);
  return text;
}

}  // namespace mono_pose_tracker
