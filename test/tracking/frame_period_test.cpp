#include "tracking/frame_period.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(FramePeriod, IsUnknownUntilAFewHaveCome) {
  FramePeriod period;
  for (int i = 0; i < 5; ++i) period.note(i / 30.0, i / 30.0);
  EXPECT_EQ(period.milliseconds(), 0);
  for (int i = 5; i < 20; ++i) period.note(i / 30.0, i / 30.0);
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 1e-6);
}

TEST(FramePeriod, IsNotShortenedByImagesThatComeInBursts) {
  FramePeriod period;
  for (int i = 0; i < 40; ++i) period.note(i / 30.0, (i / 4 * 4 + 4) / 30.0);
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 0.1 * 1e3 / 30);
}

// A recording played at half its rate has twice the period.
TEST(FramePeriod, IsLongerWhereImagesComeMoreSlowlyThanTheirStamps) {
  FramePeriod period;
  for (int i = 0; i < 40; ++i) period.note(i / 30.0, i / 15.0);
  EXPECT_NEAR(period.milliseconds(), 1e3 / 15, 1e-6);
}

// Images sent one by one, each when the one before is done, arrive as fast as they are processed: that is no
// load.
TEST(FramePeriod, IsNotShorterThanTheStampsSay) {
  FramePeriod period;
  for (int i = 0; i < 40; ++i) period.note(i / 30.0, i / 100.0);
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 1e-6);
}

TEST(FramePeriod, PausesDoNotCount) {
  FramePeriod period;
  double pause_s = 0;
  for (int i = 0; i < 60; ++i) {
    if (i % 10 == 9) pause_s += 30;
    period.note(i / 30.0, i / 30.0 + pause_s);  // a delayed recording
  }
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 1e-6);
  for (int i = 60; i < 120; ++i) {
    if (i % 10 == 9) pause_s += 30;
    period.note(i / 30.0 + pause_s, i / 30.0 + pause_s);  // a camera
  }
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 1e-6);
}

TEST(FramePeriod, KnowsWhetherAnotherHasCome) {
  FramePeriod period;
  EXPECT_FALSE(period.has_come_after(0));
  period.note(7, 1);
  EXPECT_FALSE(period.has_come_after(1));
  period.note(8, 2);
  EXPECT_TRUE(period.has_come_after(1));
}

TEST(FramePeriod, StampsThatJumpBackAreNoInterval) {
  FramePeriod period;
  for (int i = 0; i < 100; ++i) period.note(i % 25 / 30.0, i / 30.0);
  EXPECT_NEAR(period.milliseconds(), 1e3 / 30, 1e-6);
}

}  // namespace
}  // namespace mono_pose_tracker
