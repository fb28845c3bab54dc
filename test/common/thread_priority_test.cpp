#include "mono_pose_tracker/common/thread_priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace mono_pose_tracker {
namespace {

int niceness() { return getpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid))); }

TEST(ThreadPriority, IsLoweredForTheCallingThreadAlone) {
  constexpr int kMost = 19;
  const int before = niceness();
  int of_thread = -100;
  std::thread thread([&] {
    lower_thread_priority(5);
    of_thread = niceness();
  });
  thread.join();
  EXPECT_EQ(of_thread, std::min(before + 5, kMost));
  EXPECT_EQ(niceness(), before);
}

}  // namespace
}  // namespace mono_pose_tracker
