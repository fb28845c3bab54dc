#include "tools/run_estimate.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

RunEstimateOptions halves() {
  RunEstimateOptions options;
  options.refining = 0.5;
  options.registering = options.writing = 0.25;
  return options;
}

TEST(RunEstimate, TrackingIsCountedInImages) {
  RunEstimate estimate(100, halves());
  estimate.begin(RecordingStage::kTracking, 1000);
  EXPECT_FALSE(estimate.seconds_left(1001));
  EXPECT_EQ(estimate.share_done(1001), 0);
  for (int i = 0; i < 25; ++i) estimate.count_image();
  // 40 s for all images, and as long for the stages after it.
  EXPECT_NEAR(estimate.seconds_left(1010).value(), 30 + 40, 1e-9);
  EXPECT_NEAR(estimate.share_done(1010), 10.0 / 80, 1e-9);
}

TEST(RunEstimate, NeverStandsStillNorFalls) {
  RunEstimate estimate(10, halves());
  double now = 0, share = 0, left = 1e9;
  const auto pass = [&](double seconds) {
    for (const double end = now + seconds; now < end;) {
      now += 5;
      const double grown = estimate.share_done(now), less = estimate.seconds_left(now).value();
      EXPECT_GT(grown, share) << now;
      EXPECT_LT(less, left) << now;
      EXPECT_LT(grown, 1);
      share = grown;
      left = less;
    }
  };
  estimate.begin(RecordingStage::kTracking, now);
  for (int i = 0; i < 10; ++i) estimate.count_image();
  now = 100;
  estimate.begin(RecordingStage::kRefining, now);
  pass(300);  // six times as long as was expected
  estimate.begin(RecordingStage::kRegistering, now);
  pass(30);
  estimate.begin(RecordingStage::kRefining, now);
  pass(20);
  estimate.begin(RecordingStage::kWriting, now);
  pass(20);
  EXPECT_GT(share, 0.9);
}

TEST(RunEstimate, AFurtherRunTakesAsLongAgain) {
  RunEstimate estimate(10, halves());
  estimate.begin(RecordingStage::kTracking, 0);
  for (int i = 0; i < 10; ++i) estimate.count_image();
  estimate.begin(RecordingStage::kRefining, 10);
  const double before = estimate.share_done(30);
  EXPECT_GT(before, 0.8);
  estimate.begin(RecordingStage::kTracking, 30);
  EXPECT_FALSE(estimate.seconds_left(31));
  EXPECT_EQ(estimate.share_done(31), before);
  estimate.count_image();
  EXPECT_NEAR(estimate.seconds_left(31).value(), 9 + 10, 1e-9);
  EXPECT_EQ(estimate.share_done(31), before);
}

TEST(RunEstimate, AnUnknownNumberOfImagesGivesNoTimeWhileTheyAreTracked) {
  RunEstimate estimate(-1, halves());
  estimate.begin(RecordingStage::kTracking, 0);
  estimate.count_image();
  EXPECT_FALSE(estimate.seconds_left(10));
  estimate.begin(RecordingStage::kRefining, 10);
  EXPECT_NEAR(estimate.seconds_left(10).value(), 10, 1e-9);
}

}  // namespace
}  // namespace mono_pose_tracker
