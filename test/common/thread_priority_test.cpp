#include "common/threads.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
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

// As the kernel tells it, 0 where it knows of none (before Linux 6.12).
std::uint64_t slice_ns() {
  struct {
    std::uint32_t size, policy;
    std::uint64_t flags;
    std::int32_t nice;
    std::uint32_t priority;
    std::uint64_t runtime, deadline, period;
  } attributes = {};
  static_assert(sizeof attributes == 48);
  syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0);
  return attributes.runtime;
}

TEST(ThreadPriority, OthersDoNotWaitLongForTheThread) {
  if (slice_ns() == 0) GTEST_SKIP() << "before Linux 6.12";
  std::uint64_t of_thread = 0;
  std::thread thread([&] {
    lower_thread_priority(5);
    of_thread = slice_ns();
  });
  thread.join();
  EXPECT_EQ(of_thread, 100'000u) << "of some ms by itself";
}

TEST(ThreadPriority, AThreadOfAnotherPolicyKeepsIt) {
  int policy = -1, asked = -1;
  std::thread thread([&] {
    const sched_param none{};
    asked = pthread_setschedparam(pthread_self(), SCHED_BATCH, &none);
    lower_thread_priority(5);
    policy = sched_getscheduler(0);
  });
  thread.join();
  ASSERT_EQ(asked, 0);
  EXPECT_EQ(policy, SCHED_BATCH);
}

}  // namespace
}  // namespace mono_pose_tracker
