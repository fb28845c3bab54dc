#pragma once

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdarg>
#include <cstdio>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace mono_pose_tracker {

/// As std::printf writes it, however long; the compiler checks the arguments.
__attribute__((format(printf, 1, 2))) inline std::string formatted(const char* format, ...) {
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

/// The text with a '?' for each control character, line ends among them: for messages that quote what others
/// wrote.
inline std::string one_line(std::string text) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

/// Reads the whole text as a decimal number of type T: the same in every locale. False, value untouched, when
/// it is none, is not finite or does not fit (a negative one into an unsigned T among them). Leading zeros
/// are refused: to YAML as ROS reads it, 0100 is octal, 64.
template <typename T>
bool parse_decimal(std::string_view text, T* value) {
  const bool negative = !text.empty() && text.front() == '-';
  if (!text.empty() && (text.front() == '+' || negative)) text.remove_prefix(1);
  const auto is_digit = [&](std::size_t i) { return i < text.size() && text[i] >= '0' && text[i] <= '9'; };
  if (!is_digit(0) && !(text.substr(0, 1) == "." && is_digit(1))) return false;
  if (text[0] == '0' && is_digit(1)) return false;
  const std::string number = (negative ? "-" : "") + std::string(text);
  T parsed{};
  if constexpr (std::is_floating_point_v<T>) {
    std::istringstream stream(number);  // std::from_chars for reals is newer than gcc 9
    stream.imbue(std::locale::classic());
    if (!(stream >> parsed) || stream.peek() != std::istringstream::traits_type::eof()) return false;
  } else {
    const auto result = std::from_chars(number.data(), number.data() + number.size(), parsed);
    if (result.ec != std::errc() || result.ptr != number.data() + number.size()) return false;
  }
  *value = parsed;
  return true;
}

/// The text of an errno value; "unknown reason" for 0. Not every failing call sets errno, so set it to 0
/// before the call. (std::strerror is not thread-safe.)
inline std::string system_error_text(int error = errno) {
  return error ? std::generic_category().message(error) : "unknown reason";
}

inline std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace mono_pose_tracker
