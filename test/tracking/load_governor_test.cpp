#include "tracking/load_governor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "mono_pose_tracker/tracking/tracker_options.h"

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

constexpr double kPeriodMs = 1e3 / 30;

// A camera and a processor with a given time for an image at each level: the newest image waits, the others
// are dropped. All arrivals are noted.
struct Live {
  FramePeriod period;
  LoadGovernor governor;
  double time_ms = 0;            // when the processor is free
  long next = 1;                 // image
  int dropped = 0, changes = 0;  // of dropped images and level changes

  void run(int images, const std::function<double(int level)>& takes_ms) {
    const long end = next + images;
    while (next < end) {
      const long newest = std::max(next, static_cast<long>(time_ms / kPeriodMs));
      dropped += static_cast<int>(newest - next);
      for (; next <= newest; ++next) {
        const double came_s = 1e-3 * static_cast<double>(next) * kPeriodMs;
        period.note(came_s, came_s);
      }
      const double arrival_ms = static_cast<double>(newest) * kPeriodMs;
      const int level = governor.level();
      time_ms = std::max(time_ms, arrival_ms) + takes_ms(level);
      const double latency_ms = time_ms - arrival_ms;
      const int now = governor.observe(period.milliseconds(), latency_ms, latency_ms > kPeriodMs);
      changes += std::max<int>(now, kFullWork) != std::max<int>(level, kFullWork);
    }
  }

  void pause(double seconds) {
    next += static_cast<long>(1e3 * seconds / kPeriodMs);
    time_ms = std::max(time_ms, static_cast<double>(next - 1) * kPeriodMs);
  }
};

TEST(LoadGovernor, LeavesNothingOutWhereThereIsTime) {
  Live live;
  live.run(900, [](int) { return 0.8 * kPeriodMs; });
  EXPECT_EQ(live.governor.level(), kFullWork);
  EXPECT_EQ(live.dropped, 0);
  // A slow image now and then is no load.
  int count = 0;
  live.run(900, [&](int) { return ++count % 30 ? 0.5 * kPeriodMs : 1.5 * kPeriodMs; });
  EXPECT_EQ(live.changes, 0);
}

TEST(LoadGovernor, DoesLessUntilImagesAreInTime) {
  for (const int enough : {1, 2, 3, 4}) {
    Live live;
    const auto takes_ms = [&](int level) { return (level < enough ? 1.6 : 0.8) * kPeriodMs; };
    live.run(200, takes_ms);
    EXPECT_EQ(live.governor.level(), enough);
    live.dropped = 0;
    live.run(300, takes_ms);
    EXPECT_EQ(live.dropped, 0);
    EXPECT_EQ(live.governor.level(), enough);
  }
}

TEST(LoadGovernor, SeesTheCamerasRateThoughMostImagesAreDropped) {
  Live live;
  live.run(600, [](int level) { return (level < kCoarserOctave ? 2.2 : 0.8) * kPeriodMs; });
  EXPECT_EQ(live.governor.level(), kCoarserOctave);
}

TEST(LoadGovernor, GoesBackUpWhenTheLoadIsGone) {
  Live live;
  live.run(300, [](int level) { return (1.6 - 0.3 * level) * kPeriodMs; });
  EXPECT_GT(live.governor.level(), kFullWork);
  live.run(900, [](int) { return 0.3 * kPeriodMs; });
  EXPECT_EQ(live.governor.level(), kFullWork);
}

// Above half of the period, as usual images of a camera may take: without the debug image and with less
// mapping there is little more time.
TEST(LoadGovernor, GoesBackUpToWhatJustFits) {
  Live live;
  live.run(100, [](int) { return 1.5 * kPeriodMs; });
  EXPECT_GT(live.governor.level(), kFullWork);
  live.run(900, [](int level) { return (level < kFewerFeatures ? 0.65 : 0.4) * kPeriodMs; });
  EXPECT_EQ(live.governor.level(), kFullWork);
}

TEST(LoadGovernor, DoesNotSwingBetweenTwoLevels) {
  Live live;  // level 1 leaves time to spare, level 0 is too much
  const auto takes_ms = [](int level) { return (level < 1 ? 1.4 : 0.4) * kPeriodMs; };
  live.run(3600, takes_ms);
  EXPECT_LE(live.changes, 14);  // two minutes
  live.dropped = 0;
  live.run(3600, takes_ms);
  EXPECT_LE(live.dropped, 36);  // 1 %
}

// Each image is sent when the one before is answered, as by a test or a player that waits.
TEST(LoadGovernor, LeavesNothingOutForWhoWaitsForAnswers) {
  FramePeriod period;
  LoadGovernor governor;
  double time_s = 0;
  for (int i = 0; i < 900; ++i) {
    period.note(i / 30.0, time_s);
    const double takes_s = i % 3 ? 0.05 : 0.2;
    time_s += takes_s;
    governor.observe(period.milliseconds(), 1e3 * takes_s, false);
    ASSERT_LE(governor.level(), kFullWork) << i;
  }
}

TEST(LoadGovernor, HasTimeToSpareUntilTheCamerasPeriodSaysOtherwise) {
  Live slow;  // a camera, that is: the processor is fast
  slow.run(900, [](int) { return 0.4 * kPeriodMs; });
  EXPECT_EQ(slow.governor.level(), kTimeToSpare);
  Live fast;
  fast.run(12, [](int level) { return (level < kFullWork ? 1.5 : 0.3) * kPeriodMs; });
  EXPECT_EQ(fast.governor.level(), kFullWork);
  EXPECT_LE(fast.dropped, 6);
  fast.run(3600, [](int) { return 0.3 * kPeriodMs; });
  EXPECT_EQ(fast.governor.level(), kFullWork) << "eight times that is too much";
  fast.run(150, [](int) { return 0.1 * kPeriodMs; });
  EXPECT_EQ(fast.governor.level(), kTimeToSpare);
}

TEST(LoadGovernor, TimeToSpareIsForObjects) {
  TrackerOptions given;
  const auto at = [&](int level) { return given.for_images({640, 480}, SearchPace::kLive, level).sift; };
  EXPECT_EQ(at(kTimeToSpare).first_octave, 0);
  EXPECT_TRUE(at(kTimeToSpare).finer_for_small_objects);
  EXPECT_FALSE(at(kFullWork).finer_for_small_objects);
  given.segmentation.body = "turning";
  ASSERT_TRUE(given.segmentation.wants_turning_object());
  EXPECT_EQ(at(kTimeToSpare).first_octave, -1);
  EXPECT_EQ(at(kFullWork).first_octave, 0);
  EXPECT_EQ(given.for_images({1920, 1080}, SearchPace::kLive, kTimeToSpare).sift.reduction, 2)
      << "finer than usual";
  given.sift.first_octave = 1;
  EXPECT_EQ(at(kTimeToSpare).first_octave, 1) << "it was chosen";
}

TEST(LoadGovernor, EachLevelExcludesMore) {
  TrackerOptions given;
  const auto at = [&](int level) { return given.for_images({640, 480}, SearchPace::kLive, level); };
  EXPECT_EQ(at(kLittleDrawn).mapping.window_keyframes, given.mapping.window_keyframes);
  EXPECT_EQ(at(kLessMapped).mapping.window_keyframes, given.mapping.window_keyframes / 2);
  EXPECT_EQ(at(kLessMapped).sift.max_features, given.sift.max_features);
  EXPECT_EQ(at(kFewerFeatures).sift.max_features, given.sift.max_features / 2);
  EXPECT_EQ(at(kFewerFeatures).sift.min_features, given.sift.min_features / 2);
  EXPECT_EQ(at(kFewerFeatures).sift.first_octave, 0);
  EXPECT_EQ(at(kCoarserOctave).sift.first_octave, 1);
  EXPECT_EQ(at(kCoarserOctave).mapping.window_keyframes, given.mapping.window_keyframes / 2);
  const SiftOptions large = given.for_images({3840, 2160}, SearchPace::kLive, kCoarserOctave).sift;
  EXPECT_EQ(large.first_octave, 1);
  EXPECT_EQ(large.reduction, 5);
  for (int level = kFullWork; level <= kCoarserOctave; ++level) EXPECT_NO_THROW(at(level).validate());
  given.sift.first_octave = 0;
  EXPECT_EQ(at(kCoarserOctave).sift.first_octave, 0) << "it was chosen";
}

TEST(LoadGovernor, APauseIsNoSlowCamera) {
  Live live;
  live.run(100, [](int) { return 0.8 * kPeriodMs; });
  live.pause(60);
  live.run(100, [](int) { return 0.8 * kPeriodMs; });
  EXPECT_EQ(live.changes, 0);
}

}  // namespace
}  // namespace mono_pose_tracker
