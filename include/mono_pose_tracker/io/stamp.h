#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace mono_pose_tracker {

/// Decimal seconds ("1403715273.262142976", also with an exponent) to nanoseconds, without passing through a
/// double; digits beyond the ninth decimal are rounded. False, stamp untouched, when the text is no number or
/// beyond kMaxStampNs.
bool parse_stamp(std::string_view seconds, std::int64_t* stamp_ns);

/// Seconds with 9 decimals, exact.
std::string format_stamp(std::int64_t stamp_ns);

}  // namespace mono_pose_tracker
