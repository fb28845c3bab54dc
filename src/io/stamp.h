#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace mono_pose_tracker {

/// Decimal seconds ("1403715273.262142976", also with an exponent) to nanoseconds, without passing through a
/// double; digits beyond the ninth decimal are rounded. False, stamp untouched, when the text is no number or
/// beyond kMaxStampNs.
bool parse_stamp(std::string_view seconds, std::int64_t* stamp_ns);

/// As parse_stamp; a whole number that is too large for seconds is in ms, us or ns, by its size
/// (1403636579763, 1403636579763555584). is_ns: any whole number is in ns.
bool parse_stamp_of_any_unit(std::string_view text, bool is_ns, std::int64_t* stamp_ns);

/// Seconds with 9 decimals, exact.
std::string format_stamp(std::int64_t stamp_ns);

}  // namespace mono_pose_tracker
