#include "memory_usage.h"

#include <fstream>
#include <string>

namespace mono_pose_tracker {
namespace {

double status_mb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(key.size())) / 1024;  // given in kB
  }
  return 0;
}

}  // namespace

double resident_mb() { return status_mb("VmRSS:"); }

double peak_resident_mb() { return status_mb("VmHWM:"); }

void restart_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace mono_pose_tracker
