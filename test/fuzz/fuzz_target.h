#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <stdexcept>
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

/// Takes values off the front of the bytes; zeros when none are left.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), size_(size) {}

  bool empty() const { return size_ == 0; }

  template <typename Number>
  Number take() {
    Number value{};
    const std::size_t n = size_ < sizeof(value) ? size_ : sizeof(value);
    if (n > 0) std::memcpy(&value, bytes_, n);
    bytes_ += n;
    size_ -= n;
    return value;
  }

  /// At most so many of the bytes that are left.
  std::string take_text(std::size_t most) {
    const std::size_t n = size_ < most ? size_ : most;
    std::string text(reinterpret_cast<const char*>(bytes_), n);
    bytes_ += n;
    size_ -= n;
    return text;
  }
  std::string take_rest() { return take_text(size_); }

 private:
  const std::uint8_t* bytes_;
  std::size_t size_;
};

/// A file in memory with these bytes, for readers that take a path. No other process sees it.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* bytes, std::size_t size) : file_(memfd_create("fuzz", MFD_CLOEXEC)) {
    if (file_ < 0 || write(file_, bytes, size) != static_cast<ssize_t>(size)) {
      throw std::runtime_error("no file in memory");
    }
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  const int file_;
};

/// Ends the program, in every build, when what a function returns breaks its promise.
#define FUZZ_CHECK(condition)                                                             \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

/// The reader's only way to refuse: one line, naming what is at fault.
inline bool is_one_line(const char* message) { return *message && !std::strchr(message, '\n'); }

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
