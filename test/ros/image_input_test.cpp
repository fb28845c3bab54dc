#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ros/image_input.h"

namespace mono_pose_tracker {
namespace {

using Verdict = TimeGuard::Verdict;
constexpr std::int64_t kSecond = 1000000000;

TEST(TimeGuard, StampsMustGrow) {
  TimeGuard guard(kSecond);
  EXPECT_EQ(guard.check(10 * kSecond), Verdict::kAccept);
  EXPECT_EQ(guard.check(10 * kSecond), Verdict::kStale);
  EXPECT_EQ(guard.check(9 * kSecond), Verdict::kStale) << "a step back of no more than the limit";
  EXPECT_EQ(guard.check(10 * kSecond + 1), Verdict::kAccept);
}

TEST(TimeGuard, ALargeStepBackIsANewStart) {
  TimeGuard guard(kSecond);
  EXPECT_EQ(guard.check(10 * kSecond), Verdict::kAccept);
  EXPECT_EQ(guard.check(9 * kSecond - 1), Verdict::kJumpedBack);
  EXPECT_EQ(guard.check(9 * kSecond), Verdict::kAccept);
}

TEST(TimeGuard, AStaleStampMovesNothing) {
  TimeGuard guard(kSecond);
  guard.check(10 * kSecond);
  guard.check(9 * kSecond + kSecond / 2);
  EXPECT_EQ(guard.last(), 10 * kSecond);
}

TEST(TimeGuard, RestartAcceptsAnything) {
  TimeGuard guard(kSecond);
  guard.check(10 * kSecond);
  guard.restart();
  EXPECT_EQ(guard.check(10 * kSecond), Verdict::kAccept);
}

TEST(ImageSlot, KeepsTheNewestAndReturnsTheDisplaced) {
  ImageSlot<int> slot;
  EXPECT_FALSE(slot.put(1));
  EXPECT_EQ(slot.put(2), 1);
  EXPECT_EQ(slot.put(3), 2);
  EXPECT_EQ(slot.take(), 3);
  EXPECT_FALSE(slot.put(4));
  EXPECT_EQ(slot.take(), 4);
}

TEST(ImageSlot, WithMoreRoomKeepsTheOrder) {
  ImageSlot<int> slot(2);
  EXPECT_FALSE(slot.put(1));
  EXPECT_FALSE(slot.put(2));
  EXPECT_EQ(slot.put(3), 1);
  EXPECT_EQ(slot.take(), 2);
  EXPECT_EQ(slot.take(), 3);
}

TEST(ImageSlot, RunsCommandsBeforeTheItemOnTheTakersThread) {
  ImageSlot<int> slot;
  std::vector<int> ran;
  std::thread::id thread;
  slot.put(1);
  ASSERT_TRUE(slot.post([&] { ran.push_back(1); }));
  ASSERT_TRUE(slot.post([&] {
    ran.push_back(2);
    thread = std::this_thread::get_id();
  }));
  std::thread taker([&] {
    EXPECT_EQ(slot.take(), 1);
    EXPECT_EQ(thread, std::this_thread::get_id());
  });
  taker.join();
  EXPECT_EQ(ran, (std::vector<int>{1, 2}));
}

TEST(ImageSlot, CloseWakesTheTakerAndHandsItemsBack) {
  ImageSlot<int> slot;
  std::future<std::optional<int>> taken = std::async(std::launch::async, [&] { return slot.take(); });
  slot.close();
  EXPECT_FALSE(taken.get());
  EXPECT_EQ(slot.put(5), 5);
  EXPECT_FALSE(slot.post([] {}));
}

TEST(ImageSlot, ACommandThatThrowsIsReportedAndEndsNothing) {
  std::string error;
  ImageSlot<int> slot(1, [&](const std::string& text) { error = text; });
  bool has_run = false;
  slot.post([] { throw std::runtime_error("no such file"); });
  slot.post([&] { has_run = true; });
  slot.put(7);
  EXPECT_EQ(slot.take(), 7);
  EXPECT_EQ(error, "no such file");
  EXPECT_TRUE(has_run) << "what was posted after it";
}

TEST(ImageSlot, EveryItemIsTakenOrDisplaced) {
  ImageSlot<int> slot;
  constexpr int kItems = 2000;
  std::vector<int> seen(kItems + 1, 0);
  std::thread taker([&] {
    std::optional<int> item;
    do {
      item = slot.take();
      ++seen[static_cast<std::size_t>(*item)];
    } while (*item != kItems);
  });
  std::vector<int> displaced;
  for (int i = 0; i <= kItems; ++i) {
    if (const std::optional<int> item = slot.put(i)) displaced.push_back(*item);
  }
  taker.join();
  for (const int item : displaced) ++seen[static_cast<std::size_t>(item)];
  EXPECT_EQ(seen, std::vector<int>(kItems + 1, 1));
}

}  // namespace

}  // namespace mono_pose_tracker
