#include "ros/memory_use.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

namespace mono_pose_tracker {

std::optional<MemoryUse> memory_use(const std::string& proc) {
  MemoryUse use;
  std::uint64_t pages = 0;
  std::ifstream(proc + "/self/statm") >> pages >> pages;  // the second is the resident part
  use.resident = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::ifstream machine(proc + "/meminfo");
  for (std::string key, value, unit; machine >> key >> value && std::getline(machine, unit);) {
    constexpr std::uint64_t kKilobyte = 1024;
    if (key == "MemTotal:") use.total = std::strtoull(value.c_str(), nullptr, 10) * kKilobyte;
    if (key == "MemAvailable:") use.available = std::strtoull(value.c_str(), nullptr, 10) * kKilobyte;
  }
  if (use.resident == 0 || use.available == 0 || use.available > use.total) return std::nullopt;
  return use;
}

std::optional<double> KeyframeMemory::bytes_per_keyframe(std::uint64_t resident, std::uint32_t map,
                                                         std::uint32_t keyframes) {
  constexpr std::uint32_t kLeast = 10;
  if (map != map_ || keyframes < first_keyframes_ || first_keyframes_ == 0) {
    map_ = map;
    first_keyframes_ = keyframes;
    first_resident_ = resident;
  }
  if (first_keyframes_ == 0 || keyframes < first_keyframes_ + kLeast) return std::nullopt;
  return static_cast<double>(std::max(resident, first_resident_) - first_resident_) /
         (keyframes - first_keyframes_);
}

}  // namespace mono_pose_tracker
