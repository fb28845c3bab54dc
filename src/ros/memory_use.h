#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace mono_pose_tracker {

/// Memory of this process and of the machine, in bytes.
struct MemoryUse {
  std::uint64_t resident = 0;              // of this process
  std::uint64_t total = 0, available = 0;  // of the machine

  double used_share() const { return 1 - static_cast<double>(available) / static_cast<double>(total); }
};

/// proc: where procfs is mounted. Nothing where it does not give these values.
std::optional<MemoryUse> memory_use(const std::string& proc = "/proc");

/// Estimates how much memory a keyframe takes, from how the process grows with its map. One thread.
class KeyframeMemory {
 public:
  /// Bytes for each keyframe since the beginning of this map; nothing before it has grown by ten.
  std::optional<double> bytes_per_keyframe(std::uint64_t resident, std::uint32_t map,
                                           std::uint32_t keyframes);

 private:
  std::uint32_t map_ = 0;
  std::uint32_t first_keyframes_ = 0;
  std::uint64_t first_resident_ = 0;
};

}  // namespace mono_pose_tracker
