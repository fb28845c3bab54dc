#include "ros/diagnostics.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

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
