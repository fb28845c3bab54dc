#include "ros/reporting.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

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
