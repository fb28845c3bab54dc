#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace mono_pose_tracker {

/// The same bits as another type.
template <typename To, typename From>
To bits_as(From value) {
  static_assert(sizeof(To) == sizeof(From));
  To result;
  std::memcpy(&result, &value, sizeof result);
  return result;
}

/// Appends numbers to a string of bytes, little-endian on every machine.
class ByteWriter {
 public:
  void u8(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void u32(std::uint32_t value) { put(value, 4); }
  void u64(std::uint64_t value) { put(value, 8); }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
  void i64(std::int64_t value) { u64(static_cast<std::uint64_t>(value)); }
  void f32(float value) { u32(bits_as<std::uint32_t>(value)); }
  void f64(double value) { u64(bits_as<std::uint64_t>(value)); }
  void raw(const void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  void text(const std::string& value) {
    u32(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  void put(std::uint64_t value, int size) {
    char bytes[8];
    for (int i = 0; i < size; ++i) bytes[i] = static_cast<char>(static_cast<std::uint8_t>(value >> (8 * i)));
    bytes_.append(bytes, static_cast<std::size_t>(size));
  }

  std::string bytes_;
};

/// Takes them out again. Throws std::runtime_error at the end of the bytes.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(raw(1)[0]); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(take(4)); }
  std::uint64_t u64() { return take(8); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  std::int64_t i64() { return static_cast<std::int64_t>(u64()); }
  float f32() { return bits_as<float>(u32()); }
  double f64() { return bits_as<double>(u64()); }
  std::string text() { return std::string(raw(u32())); }

  /// The number of items that follow; what is left must have room for them at `least_size` bytes each.
  std::uint32_t count(std::size_t least_size) {
    const std::uint32_t n = u32();
    if (n > bytes_.size() / least_size) cut_short();
    return n;
  }

  std::string_view raw(std::uint64_t size) {
    if (size > bytes_.size()) cut_short();
    const std::string_view result = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return result;
  }

  std::size_t left() const { return bytes_.size(); }

 private:
  [[noreturn]] static void cut_short() {
    throw std::runtime_error("is truncated, expected the complete data");
  }

  std::uint64_t take(int size) {
    const std::string_view bytes = raw(static_cast<std::uint64_t>(size));
    std::uint64_t value = 0;
    for (int i = 0; i < size; ++i) value |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
    return value;
  }

  std::string_view bytes_;
};

}  // namespace mono_pose_tracker
