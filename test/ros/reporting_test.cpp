#include <gtest/gtest.h>

#include <stdexcept>

#include "ros/reporting.h"

namespace mono_pose_tracker {
namespace {

TEST(Guard, TellsWhateverIsThrown) {
  std::string reported;
  const auto report = [&](const std::string& text) { reported = text; };
  guarded([] { throw std::runtime_error("the reason"); }, report);
  EXPECT_EQ(reported, "the reason");
  guarded([] { throw 7; }, report);
  EXPECT_EQ(reported, "unknown exception");
  reported.clear();
  guarded([] {}, report);
  EXPECT_EQ(reported, "");
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
