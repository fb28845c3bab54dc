#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace mono_pose_tracker {

/// Reads plain CDR (the encoding of ROS 2 messages, OMG DDS-XTypes 7.4.1): values lie at multiples of their
/// size behind the four bytes of the encapsulation header. Throws std::runtime_error, one line, at the end of
/// the bytes and on another encapsulation.
///
///     CdrReader in(bytes);
///     const std::uint32_t height = in.u32();
///     const std::string encoding = in.text();
class CdrReader {
 public:
  explicit CdrReader(std::string_view bytes) : bytes_(bytes) {
    if (bytes.size() < kHeaderSize || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1)) {
      throw std::runtime_error("is not encoded in plain CDR");
    }
    is_little_endian_ = bytes[1] == 1;
  }

  std::uint8_t u8() { return static_cast<std::uint8_t>(take(1)[0]); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  double f64() {
    const std::uint64_t bits = number(8);
    double value = 0;
    static_assert(sizeof value == sizeof bits);
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  /// Without the zero at its end.
  std::string text() {
    std::string_view letters = take(u32());
    if (!letters.empty() && letters.back() == '\0') letters.remove_suffix(1);
    return std::string(letters);
  }
  /// The elements of a sequence of bytes.
  std::string_view octets() { return take(u32()); }
  /// The length of a sequence of elements of the given size; there is room for them in what is left.
  std::uint32_t length(std::size_t element_size) {
    const std::uint32_t count = u32();
    if (count > (bytes_.size() - at_) / element_size) cut_short();
    return count;
  }

 private:
  static constexpr std::size_t kHeaderSize = 4;

  [[noreturn]] static void cut_short() { throw std::runtime_error("is truncated"); }

  std::string_view take(std::size_t size) {
    if (size > bytes_.size() - at_) cut_short();
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }

  std::uint64_t number(std::size_t size) {
    const std::size_t beyond = (at_ - kHeaderSize) % size;
    if (beyond > 0) take(size - beyond);
    const std::string_view digits = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t place = is_little_endian_ ? i : size - 1 - i;
      value |= std::uint64_t{static_cast<std::uint8_t>(digits[i])} << (8 * place);
    }
    return value;
  }

  std::string_view bytes_;
  std::size_t at_ = kHeaderSize;
  bool is_little_endian_ = true;
};

}  // namespace mono_pose_tracker
