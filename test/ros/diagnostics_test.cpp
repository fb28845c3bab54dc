#include "mono_pose_tracker/ros/diagnostics.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

using diagnostic_msgs::DiagnosticStatus;

diagnostic_updater::DiagnosticStatusWrapper told(const Health& health) {
  diagnostic_updater::DiagnosticStatusWrapper status;
  fill_diagnostics(health, status);
  return status;
}

Health tracking() {
  Health health;
  health.last.state = TrackerStatus::TRACKING;
  health.last.state_name = "TRACKING";
  health.last.reason = TrackerStatus::OK;
  health.last.frames_received = 10;
  return health;
}

// It tracks, but what it was asked to write is not there.
TEST(Diagnostics, AFileThatCannotBeWrittenIsAWarning) {
  EXPECT_EQ(told(tracking()).level, DiagnosticStatus::OK);
  Health health = tracking();
  health.output_problem = "t.txt: cannot be written (No space left on device); 3 poses wait";
  EXPECT_EQ(told(health).level, DiagnosticStatus::WARN);
  EXPECT_NE(told(health).message.find(health.output_problem), std::string::npos);
  health.input_problem = "no image";
  EXPECT_EQ(told(health).level, DiagnosticStatus::ERROR) << "what keeps it from working comes first";
  EXPECT_EQ(told(health).message, "no image");
}

}  // namespace
}  // namespace mono_pose_tracker
