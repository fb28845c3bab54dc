#pragma once

#include <boost/crc.hpp>
#include <cstdint>
#include <string_view>

namespace mono_pose_tracker {

// The line end shows whether a transfer as text mangled the file.
constexpr std::string_view kMapFileMagic("MPTMAP\r\n", 8);
constexpr int kMapFileDescriptorBytes = 128;
constexpr std::uint32_t kMapFileSectionsOfMap = 3;  // KEYF, REMV, LAND

// Of a section: name and size, then the payload.
inline std::uint32_t map_file_crc(std::string_view name_and_size, std::string_view payload) {
  boost::crc_32_type crc;
  crc.process_bytes(name_and_size.data(), name_and_size.size());
  crc.process_bytes(payload.data(), payload.size());
  return crc.checksum();
}

}  // namespace mono_pose_tracker
