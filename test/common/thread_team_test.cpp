#include "common/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "support/no_threads.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
