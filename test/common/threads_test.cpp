#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/threads.h"

namespace mono_pose_tracker {
namespace {

/// No thread can be started while this object exists: the default stack size is as large as the address
/// space.
class NoThreads {
 public:
  NoThreads() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t endless;
    pthread_getattr_default_np(&endless);
    pthread_attr_setstacksize(&endless, std::size_t{1} << 50);
    pthread_setattr_default_np(&endless);
    pthread_attr_destroy(&endless);
  }
  ~NoThreads() {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_{};
};

class ParallelTest : public testing::TestWithParam<int> {};

TEST_P(ParallelTest, DoesEachOnce) {
  for (const int count : {-1, 0, 1, 2, 7, 1000}) {
    std::vector<int> done(std::max(count, 0), 0);
    parallel_for(count, GetParam(), [&](int i) { ++done[i]; });
    EXPECT_EQ(done, std::vector<int>(done.size(), 1)) << count;
  }
}

TEST_P(ParallelTest, WhatIsThrownComesOut) {
  std::atomic<int> done{0};
  const auto work = [&](int i) {
    if (i == 5) throw std::runtime_error("five");
    ++done;
  };
  EXPECT_THROW(parallel_for(1000, GetParam(), work), std::runtime_error);
  EXPECT_LT(done, 1000);
}

// Each waits for the other: a single thread would hang here.
TEST(Parallel, ThreadsRunAtTheSameTime) {
  std::atomic<int> begun{0};
  parallel_for(2, 2, [&](int) {
    ++begun;
    while (begun < 2) std::this_thread::yield();
  });
  EXPECT_EQ(begun, 2);
}

TEST(Parallel, WhereNoThreadIsToBeHadTheCallerDoesItAll) {
  const NoThreads none;
  EXPECT_TRUE(start_threads(3, [] {}).empty());
  std::vector<int> done(100, 0);
  parallel_for(100, 8, [&](int i) { ++done[i]; });
  EXPECT_EQ(done, std::vector<int>(100, 1));
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelTest, testing::Values(1, 2, 7));

class ThreadTeamTest : public testing::TestWithParam<int> {};

TEST_P(ThreadTeamTest, DoesEachOnceInEveryPieceOfWork) {
  ThreadTeam team(GetParam());
  for (int repeated = 0; repeated < 2000; ++repeated) {
    for (const int count : {-1, 0, 1, 2, 7, 40}) {
      std::vector<int> done(std::max(count, 0), 0);
      team.for_each(count, [&](int i) { ++done[i]; });
      ASSERT_EQ(done, std::vector<int>(done.size(), 1)) << count;
      team.for_runs(count, 3, [&](int i) { ++done[i]; });
      ASSERT_EQ(done, std::vector<int>(done.size(), 2)) << count;
    }
  }
}

TEST_P(ThreadTeamTest, WhatIsThrownComesOutAndTheNextWorkIsDone) {
  ThreadTeam team(GetParam());
  for (int repeated = 0; repeated < 200; ++repeated) {
    std::atomic<int> done{0};
    std::atomic<bool> thrown{false};
    const auto work = [&](int i) {
      if (i == 5) {
        thrown = true;
        throw std::runtime_error("five");
      }
      // Each one yields, so that the thread that throws is not kept from it by those that go on.
      do {
        std::this_thread::yield();
      } while (i > 5 && !thrown);
      ++done;
    };
    ASSERT_THROW(team.for_each(1000000, work), std::runtime_error);
    ASSERT_LT(done, 500000) << "most were begun after one had thrown";
    done = 0;
    team.for_each(1000, [&](int) { ++done; });
    ASSERT_EQ(done, 1000);
  }
}

// Each waits for the other: a single thread would hang here. In the later rounds the others have gone to
// sleep.
TEST(ThreadTeam, ThreadsRunAtTheSameTimeAlsoAfterAPause) {
  ThreadTeam team(2);
  for (const int pause_ms : {0, 0, 5, 0, 5}) {
    std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
    std::atomic<int> begun{0};
    team.for_each(2, [&](int) {
      ++begun;
      while (begun < 2) std::this_thread::yield();
    });
  }
}

TEST(ThreadTeam, WhereNoThreadIsToBeHadTheCallerDoesItAll) {
  const NoThreads none;
  ThreadTeam team(8);
  std::vector<int> done(100, 0);
  team.for_each(100, [&](int i) { ++done[i]; });
  EXPECT_EQ(done, std::vector<int>(100, 1));
}

INSTANTIATE_TEST_SUITE_P(Threads, ThreadTeamTest, testing::Values(1, 2, 7));

struct Number {
  int value = -1;
  int square = -1;
};

class PrefetcherTest : public testing::TestWithParam<int> {};

TEST_P(PrefetcherTest, GivesEveryItemInTheOrderRead) {
  int read = 0;
  Prefetcher<Number> numbers(
      [&](Number* n) {
        if (read == 200) return false;
        n->value = read++;
        return true;
      },
      [](Number* n) { n->square = n->value * n->value; }, GetParam());
  Number n;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(numbers.next(&n));
    EXPECT_EQ(n.value, i);
    EXPECT_EQ(n.square, i * i);
  }
  EXPECT_FALSE(numbers.next(&n));
  EXPECT_FALSE(numbers.next(&n));
}

TEST_P(PrefetcherTest, AnErrorComesAtItsPlace) {
  for (const bool in_read : {true, false}) {
    int read = 0;
    Prefetcher<Number> numbers(
        [&](Number* n) {
          n->value = read++;
          if (in_read && n->value == 5) throw std::runtime_error("five");
          return true;
        },
        [&](Number* n) {
          if (!in_read && n->value == 5) throw std::runtime_error("five");
        },
        GetParam());
    Number n;
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(numbers.next(&n));
    EXPECT_THROW(numbers.next(&n), std::runtime_error);
  }
}

TEST_P(PrefetcherTest, RunsAheadByABoundedNumberAndStopsWhenNobodyAsks) {
  std::atomic<int> read{0};
  {
    Prefetcher<Number> endless(
        [&](Number*) {
          ++read;
          return true;
        },
        [](Number*) {}, GetParam());
    Number n;
    for (int i = 1; i <= 20; ++i) {
      ASSERT_TRUE(endless.next(&n));
      EXPECT_LE(read, i + GetParam() + 2);
    }
  }  // joins its threads: a test that hangs here fails
  EXPECT_GE(read, 20);
}

// The first item is held back until the second has been worked on, which a single thread ahead can't do: the
// caller does.
TEST(Prefetcher, WhoeverWaitsForAnItemWorksOnWhatFollows) {
  int read = 0;
  std::promise<void> second_done;
  std::shared_future<void> is_second_done(second_done.get_future());
  std::thread::id first_by, second_by;
  Prefetcher<Number> numbers(
      [&](Number* n) {
        n->value = read++;
        return n->value < 2;
      },
      [&](Number* n) {
        (n->value == 0 ? first_by : second_by) = std::this_thread::get_id();
        n->value == 0 ? is_second_done.wait() : second_done.set_value();
      },
      1);
  Number n;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(numbers.next(&n));
    EXPECT_EQ(n.value, i);
  }
  EXPECT_FALSE(numbers.next(&n));
  EXPECT_NE(first_by, second_by);
}

TEST(Prefetcher, WhereNoThreadIsToBeHadTheCallerDoesItAll) {
  const NoThreads none;
  int read = 0;
  Prefetcher<Number> numbers(
      [&](Number* n) {
        n->value = read++;
        return n->value < 3;
      },
      [](Number* n) { n->value *= 10; }, 4);
  Number n;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(numbers.next(&n));
    EXPECT_EQ(n.value, 10 * i);
  }
  EXPECT_FALSE(numbers.next(&n));
}

INSTANTIATE_TEST_SUITE_P(Threads, PrefetcherTest, testing::Values(0, 1, 3, 8));

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
