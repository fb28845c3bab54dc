#pragma once

#include <algorithm>
#include <string>

namespace mono_pose_tracker {

/// The text with a '?' for each control character, line ends among them: for messages that quote what others
/// wrote.
inline std::string one_line(std::string text) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

}  // namespace mono_pose_tracker
