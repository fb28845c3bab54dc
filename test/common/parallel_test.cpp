#include "common/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "support/no_threads.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
