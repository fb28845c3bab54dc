#pragma once

#include <cstddef>
#include <istream>

namespace mono_pose_tracker {

/// Appends what is left of the stream, block by block: what its size was said to be, and whether it has an
/// end, is not relied on. False as soon as there are more than max_bytes; a stream that failed is bad() then.
template <typename Bytes>
bool read_whole(std::istream& stream, std::size_t max_bytes, Bytes* bytes) {
  constexpr std::size_t kBlock = 64 * 1024;
  while (stream) {
    const std::size_t before = bytes->size();
    bytes->resize(before + kBlock);
    stream.read(reinterpret_cast<char*>(bytes->data()) + before, static_cast<std::streamsize>(kBlock));
    bytes->resize(before + static_cast<std::size_t>(stream.gcount()));
    if (bytes->size() > max_bytes) return false;
  }
  return true;
}

}  // namespace mono_pose_tracker
