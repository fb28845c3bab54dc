#pragma once

#include <algorithm>
#include <string>

namespace mono_pose_tracker {

/// The text without ends of lines and other letters that are none to see: what is told about other people's
/// bytes quotes them.
inline std::string one_line(std::string text) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

}  // namespace mono_pose_tracker
