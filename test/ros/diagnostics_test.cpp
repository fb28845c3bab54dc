#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>

#include "mono_pose_tracker/common/status.h"
#include "ros/diagnostics.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

using diagnostic_msgs::DiagnosticStatus;

diagnostic_updater::DiagnosticStatusWrapper status_of(const Health& health) {
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
  EXPECT_EQ(status_of(tracking()).level, DiagnosticStatus::OK);
  Health health = tracking();
  health.output_problem = "t.txt: cannot be written (No space left on device); 3 poses wait";
  EXPECT_EQ(status_of(health).level, DiagnosticStatus::WARN);
  EXPECT_NE(status_of(health).message.find(health.output_problem), std::string::npos);
  health.input_problem = "no image";
  EXPECT_EQ(status_of(health).level, DiagnosticStatus::ERROR) << "what keeps it from working comes first";
  EXPECT_EQ(status_of(health).message, "no image");
}

TEST(Diagnostics, AMapWithoutLimitIsAWarningBeforeTheMemoryIsFull) {
  Health health = tracking();
  health.memory = MemoryUse{400 << 20, 1000 << 20, 310 << 20};
  health.bytes_per_keyframe = 0.5 * (1 << 20);
  EXPECT_EQ(status_of(health).level, DiagnosticStatus::OK) << "69 %";
  health.memory->available = 280 << 20;
  const auto status = status_of(health);
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_NE(status.message.find("72 % of the machine's memory is used"), std::string::npos) << status.message;
  EXPECT_NE(status.message.find("about 0.50 MB for each keyframe"), std::string::npos) << status.message;
  EXPECT_NE(status.message.find("mapping/max_keyframes"), std::string::npos) << status.message;
  const auto value_of = [&](const std::string& key) {
    for (const auto& value : status.values) {
      if (value.key == key) return value.value;
    }
    return std::string("none");
  };
  EXPECT_EQ(value_of("memory per keyframe (MB)"), "0.50");
  EXPECT_EQ(value_of("memory (MB)"), "400");
  EXPECT_EQ(value_of("memory of the machine in use (%)"), "72");
  health.is_map_limited = true;
  EXPECT_EQ(status_of(health).level, DiagnosticStatus::OK);
}

// An image that is refused leaves the state as it was.
TEST(Diagnostics, TrackingIsFineOnlyWhereTheImageHasAPose) {
  for (int number = 0; number <= static_cast<int>(Reason::kCalibrationChanged); ++number) {
    const Reason reason = static_cast<Reason>(number);
    Health health = tracking();
    health.last.reason = static_cast<std::uint8_t>(number);
    const bool has_pose =
        reason == Reason::kOk || reason == Reason::kDoubtfulPose || reason == Reason::kNotRigid;
    EXPECT_EQ(status_of(health).level == DiagnosticStatus::OK, has_pose) << to_string(reason);
  }
}

TEST(Diagnostics, ImagesThatCannotBeReadAreAnError) {
  Health health = tracking();
  health.last.reason = TrackerStatus::UNREADABLE_IMAGE;
  health.last.reason_name = "UNREADABLE_IMAGE";
  health.last.reason_text = "the image message is inconsistent";
  EXPECT_EQ(status_of(health).level, DiagnosticStatus::ERROR);
  EXPECT_EQ(status_of(health).message, "TRACKING: UNREADABLE_IMAGE, the image message is inconsistent");
}

// That it starts, is lost or is paused may pass by itself.
TEST(Diagnostics, StatesWithoutAPoseAreAWarning) {
  const auto level_of = [](std::uint8_t state, std::uint8_t reason) {
    Health health = tracking();
    health.last.state = state;
    health.last.reason = reason;
    return status_of(health).level;
  };
  EXPECT_EQ(level_of(TrackerStatus::BOOTSTRAPPING, TrackerStatus::FIRST_FRAME), DiagnosticStatus::WARN);
  EXPECT_EQ(level_of(TrackerStatus::LOST, TrackerStatus::RELOCALISING), DiagnosticStatus::WARN);
  EXPECT_EQ(level_of(TrackerStatus::PAUSED, TrackerStatus::REASON_PAUSED), DiagnosticStatus::WARN);
}

TEST(MemoryUse, IsReadFromProcfs) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "self");
  folder.write("self/statm", "5000 300 20 1 0 9 0\n");
  folder.write("meminfo",
               "MemTotal:  1000 kB\nMemFree:  10 kB\nMemAvailable:  250 kB\nHugePages_Total:  0\n");
  const std::optional<MemoryUse> use = memory_use(folder / "");
  ASSERT_TRUE(use);
  EXPECT_EQ(use->resident % 300, 0u);
  EXPECT_EQ(use->total, 1000u * 1024);
  EXPECT_NEAR(use->used_share(), 0.75, 1e-9);
  folder.write("meminfo", "MemTotal:  1000 kB\n");
  EXPECT_FALSE(memory_use(folder / ""));
  EXPECT_FALSE(memory_use(folder / "none"));
  EXPECT_TRUE(memory_use()) << "of this machine";
}

TEST(KeyframeMemory, IsTheGrowthOfTheProcessWithItsMap) {
  KeyframeMemory memory;
  EXPECT_FALSE(memory.bytes_per_keyframe(5000, 0, 0));
  EXPECT_FALSE(memory.bytes_per_keyframe(6000, 1, 2));
  EXPECT_FALSE(memory.bytes_per_keyframe(6500, 1, 11)) << "too few keyframes";
  EXPECT_NEAR(memory.bytes_per_keyframe(8000, 1, 12).value(), 200, 1e-9);
  EXPECT_NEAR(memory.bytes_per_keyframe(5000, 1, 22).value(), 0, 1e-9);
  EXPECT_FALSE(memory.bytes_per_keyframe(9000, 2, 50)) << "another map";
  EXPECT_NEAR(memory.bytes_per_keyframe(10000, 2, 60).value(), 100, 1e-9);
}

}  // namespace

}  // namespace mono_pose_tracker
