#include "common/text.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(Formatted, IsWhatPrintfWrites) {
  EXPECT_EQ(formatted("%d of %s, %.1f %%", 3, "four", 75.0), "3 of four, 75.0 %");
  EXPECT_EQ(formatted("%s", ""), "");
}

TEST(Formatted, NothingIsCutOff) {
  const std::string name(5000, 'x');
  EXPECT_EQ(formatted("<%s>", name.c_str()), "<" + name + ">");
}

}  // namespace
}  // namespace mono_pose_tracker
