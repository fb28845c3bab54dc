#include "tools/run_estimate.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <set>
#include <string>

#include "tools/progress.h"

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

// Standard error is this terminal while an object of this class lives.
class Terminal {
 public:
  Terminal() : terminal_(posix_openpt(O_RDWR | O_NOCTTY)), standard_error_(dup(STDERR_FILENO)) {
    if (grantpt(terminal_) != 0 || unlockpt(terminal_) != 0) return;
    user_ = open(ptsname(terminal_), O_RDWR | O_NOCTTY);
    dup2(user_, STDERR_FILENO);
  }
  ~Terminal() {
    dup2(standard_error_, STDERR_FILENO);
    for (const int descriptor : {standard_error_, user_, terminal_}) close(descriptor);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // The writing stage's next line: waits for it.
  std::string next_line() {
    while (true) {
      const std::size_t end = text_.find("\x1b[K");
      const std::string line = text_.substr(0, end);
      if (end != std::string::npos) {
        text_.erase(0, end + 3);
        if (line.find("writing") != std::string::npos) return line;
        continue;
      }
      char bytes[4096];
      const ssize_t count = read(terminal_, bytes, sizeof(bytes));
      if (count <= 0) return "";
      text_.append(bytes, static_cast<std::size_t>(count));
    }
  }

 private:
  const int terminal_, standard_error_;
  int user_ = -1;
  std::string text_;
};

// The estimate is long exceeded: its time left and its share are rounded to the same numbers.
TEST(RunProgress, TheLineChangesWhereTheEstimateStandsStill) {
  std::set<std::string> lines;
  {
    Terminal terminal;
    RunProgress progress(1, false);
    progress.begin(RecordingStage::kTracking);
    progress.show(FrameReport());
    progress.begin(RecordingStage::kWriting);
    for (int drawn = 0; drawn < 5; ++drawn) lines.insert(terminal.next_line());
  }
  EXPECT_GE(lines.size(), 4u) << *lines.begin();
}

}  // namespace
}  // namespace mono_pose_tracker
