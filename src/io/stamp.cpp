#include "io/stamp.h"

#include <algorithm>

#include "common/time_stamp.h"

namespace mono_pose_tracker {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a sign off the front: true when it is a minus.
bool take_sign(std::string_view* text) {
  if (text->empty() || (text->front() != '-' && text->front() != '+')) return false;
  const bool negative = text->front() == '-';
  text->remove_prefix(1);
  return negative;
}

/// Takes an exponent off the front; false when there is something else.
bool take_exponent(std::string_view* text, int* exponent) {
  *exponent = 0;
  if (text->empty()) return true;
  if (text->front() != 'e' && text->front() != 'E') return false;
  text->remove_prefix(1);
  const bool negative = take_sign(text);
  if (text->empty() || text->size() > 3 || !std::all_of(text->begin(), text->end(), is_digit)) return false;
  for (char c : *text) *exponent = 10 * *exponent + (c - '0');
  if (negative) *exponent = -*exponent;
  return true;
}

/// The value of digits with `decimals` of them after the point, in units of 1e-9. False when it is beyond
/// kMaxStampNs.
bool to_nanoseconds(const std::string& digits, int decimals, std::uint64_t* value) {
  constexpr std::uint64_t kLimit = kMaxStampNs;
  const int kept = static_cast<int>(digits.size()) - decimals + 9;  // digits down to the nanosecond
  *value = 0;
  for (int i = 0; i < kept; ++i) {
    const std::uint64_t digit = i < static_cast<int>(digits.size()) ? digits[i] - '0' : 0;
    if (*value > (kLimit - digit) / 10) return false;
    *value = 10 * *value + digit;
  }
  const bool round_up = kept >= 0 && kept < static_cast<int>(digits.size()) && digits[kept] >= '5';
  if (round_up && *value == kLimit) return false;
  *value += round_up;
  return true;
}

}  // namespace

bool parse_stamp(std::string_view text, std::int64_t* stamp_ns) {
  const bool negative = take_sign(&text);
  std::string digits;
  int decimals = 0;
  bool after_point = false;
  while (!text.empty() && (is_digit(text.front()) || (text.front() == '.' && !after_point))) {
    if (text.front() == '.') {
      after_point = true;
    } else {
      digits += text.front();
      decimals += after_point;
    }
    text.remove_prefix(1);
  }
  int exponent = 0;
  std::uint64_t value = 0;
  if (digits.empty() || !take_exponent(&text, &exponent)) return false;
  if (!to_nanoseconds(digits, decimals - exponent, &value)) return false;
  *stamp_ns = negative ? -static_cast<std::int64_t>(value) : static_cast<std::int64_t>(value);
  return true;
}

bool parse_stamp_of_any_unit(std::string_view text, bool is_ns, std::int64_t* stamp_ns) {
  const bool is_whole = !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
  if (!is_whole || (!is_ns && parse_stamp(text, stamp_ns))) return parse_stamp(text, stamp_ns);
  // Of this century, seconds have 10 digits; the units below 3 more each.
  const std::size_t digits = text.size();
  const bool is_of_a_unit = is_ns || digits > 14 || digits == 13 || digits == 12;
  if (!is_of_a_unit) return false;
  const int decimals = is_ns || digits > 16 ? 9 : digits > 13 ? 6 : 3;
  return parse_stamp(std::string(text) + "e-" + std::to_string(decimals), stamp_ns);
}

std::string format_stamp(std::int64_t stamp_ns) {
  // Through unsigned numbers: the smallest int64 has no positive counterpart.
  const std::uint64_t magnitude =
      stamp_ns < 0 ? ~static_cast<std::uint64_t>(stamp_ns) + 1 : static_cast<std::uint64_t>(stamp_ns);
  const std::string decimals = std::to_string(magnitude % 1000000000u);
  return (stamp_ns < 0 ? "-" : "") + std::to_string(magnitude / 1000000000u) + '.' +
         std::string(9 - decimals.size(), '0') + decimals;
}

}  // namespace mono_pose_tracker
