#include "ros/image_input.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace mono_pose_tracker
