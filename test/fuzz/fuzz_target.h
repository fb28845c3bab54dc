#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <string>

namespace mono_pose_tracker {

using FuzzTarget = std::function<void(const std::uint8_t* bytes, std::size_t size)>;

/// The targets of this program by name.
inline std::map<std::string, FuzzTarget>& fuzz_targets() {
  static std::map<std::string, FuzzTarget> targets;
  return targets;
}

/// Of all threads: wall time is the machine's and what else it does.
constexpr double kMostCpuSeconds = 5;

inline void require_quick(std::clock_t start) {
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  if (seconds <= kMostCpuSeconds) return;
  std::fprintf(stderr, "quickness does not hold: %.1f s of CPU time\n", seconds);
  std::abort();
}

}  // namespace mono_pose_tracker

/// Begins the definition of a function of `bytes` and `size`, which accepts any bytes. It must not throw, and
/// its results must hold what the tested header promises (see FUZZ_CHECK). libFuzzer generates the bytes
/// (scripts/fuzz); the ordinary tests replay those in corpus/NAME.
#ifdef MONO_POSE_TRACKER_LIBFUZZER
#define FUZZ_TARGET(name)                                                              \
  static void fuzz_##name(const std::uint8_t* bytes, std::size_t size);                \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) { \
    const std::clock_t start = std::clock();                                           \
    fuzz_##name(bytes, size);                                                          \
    mono_pose_tracker::require_quick(start);                                           \
    return 0;                                                                          \
  }                                                                                    \
  static void fuzz_##name(const std::uint8_t* bytes, std::size_t size)
#else
#define FUZZ_TARGET(name)                                                    \
  static void fuzz_##name(const std::uint8_t* bytes, std::size_t size);      \
  static const bool is_registered_##name =                                   \
      mono_pose_tracker::fuzz_targets().emplace(#name, &fuzz_##name).second; \
  static void fuzz_##name([[maybe_unused]] const std::uint8_t* bytes, [[maybe_unused]] std::size_t size)
#endif
