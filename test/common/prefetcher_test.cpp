#include "common/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>

#include "support/no_threads.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
