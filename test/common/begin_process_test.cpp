#include "common/begin_process.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <fstream>

namespace mono_pose_tracker {
namespace {

std::size_t resident_bytes() {
  std::size_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// How much more memory the process has after a block of this size was used and freed.
std::size_t kept_of_block(std::size_t bytes) {
  const std::size_t before = resident_bytes();
  auto* const block = static_cast<volatile char*>(std::malloc(bytes));  // or all of it is optimised away
  for (std::size_t i = 0; i < bytes; i += 1024) block[i] = 1;
  void* const small_one_behind = std::malloc(64);
  std::free(const_cast<char*>(block));
  const std::size_t after = resident_bytes();
  std::free(small_one_behind);
  return after - std::min(before, after);
}

// In a process of its own, as the limits of malloc are those of a process.
TEST(BeginProcess, LargeBlocksAreGivenBackAndSmallerOnesKept) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another malloc";
#endif
  constexpr std::size_t kMb = std::size_t{1} << 20;
  const auto begin_and_check = [] {
    begin_process();
    const std::size_t of_large = kept_of_block(16 * kMb), of_small = kept_of_block(3 * kMb);
    std::exit(of_large < kMb ? (of_small > 2 * kMb ? 0 : 2) : 1);
  };
  EXPECT_EXIT(begin_and_check(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace mono_pose_tracker
