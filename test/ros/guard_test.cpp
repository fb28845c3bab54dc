#include "ros/reporting.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace mono_pose_tracker {
namespace {

TEST(Guard, TellsWhateverIsThrown) {
  std::string told;
  const auto tell = [&](const std::string& text) { told = text; };
  guarded([] { throw std::runtime_error("the reason"); }, tell);
  EXPECT_EQ(told, "the reason");
  guarded([] { throw 7; }, tell);
  EXPECT_EQ(told, "unknown exception");
  told.clear();
  guarded([] {}, tell);
  EXPECT_EQ(told, "");
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

}  // namespace
}  // namespace mono_pose_tracker
