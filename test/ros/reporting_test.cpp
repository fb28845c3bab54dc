#include <gtest/gtest.h>

#include <stdexcept>

#include "ros/reporting.h"

namespace mono_pose_tracker {
namespace {

TEST(Guard, TellsWhateverIsThrown) {
  std::string told;
  const auto tell = [&](const std::string& text) { told = text; };
  guarded([] { throw std::runtime_error("the reason"); }, tell);
  EXPECT_EQ(told, "the reason");
  guarded([] { throw 7; }, tell);
  EXPECT_EQ(told, "unknown exception");
  told.clear();
  guarded([] {}, tell);
  EXPECT_EQ(told, "");
}

TEST(Guard, TellingMayFail) {
  bool asked = false;
  guarded([] { throw std::runtime_error("the reason"); },
          [&](const std::string&) {
            asked = true;
            throw std::bad_alloc();
          });
  EXPECT_TRUE(asked);
}

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(LogThrottle, SaysASubjectOncePerPeriod) {
  LogThrottle throttle(seconds(5));
  const LogThrottle::Clock::time_point start;
  EXPECT_TRUE(throttle.due("mask", start));
  EXPECT_FALSE(throttle.due("mask", start + milliseconds(4999)));
  EXPECT_TRUE(throttle.due("mask", start + seconds(5)));
  EXPECT_FALSE(throttle.due("mask", start + seconds(6)));
}

TEST(LogThrottle, NoSubjectHidesAnother) {
  LogThrottle throttle(seconds(5)), of_another_nodelet(seconds(5));
  const LogThrottle::Clock::time_point start;
  EXPECT_TRUE(throttle.due("mask", start));
  EXPECT_TRUE(throttle.due("tf", start));
  EXPECT_TRUE(of_another_nodelet.due("mask", start));
}

TEST(LogThrottle, EventsAreAlwaysSaid) {
  LogThrottle throttle(seconds(5));
  const LogThrottle::Clock::time_point start;
  EXPECT_TRUE(throttle.due("", start));
  EXPECT_TRUE(throttle.due("", start));
}

}  // namespace

}  // namespace mono_pose_tracker
