#include "io/stamp.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/statistics.h"
#include "common/time_stamp.h"

namespace mono_pose_tracker {
namespace {

std::int64_t parsed(const std::string& text) {
  std::int64_t stamp = -77;
  EXPECT_TRUE(parse_stamp(text, &stamp)) << text;
  return stamp;
}

TEST(Stamp, ParsesWithoutLosingANanosecond) {
  EXPECT_EQ(parsed("1403715273.262142976"), 1403715273262142976);
  EXPECT_EQ(parsed("1403715273.262143"), 1403715273262143000);
  EXPECT_EQ(parsed("0"), 0);
  EXPECT_EQ(parsed("7"), 7000000000);
  EXPECT_EQ(parsed("7."), 7000000000);
  EXPECT_EQ(parsed(".5"), 500000000);
  EXPECT_EQ(parsed("-1.000000001"), -1000000001);
  EXPECT_EQ(parsed("0.0000000004"), 0);
  EXPECT_EQ(parsed("0.0000000005"), 1);
  EXPECT_EQ(parsed("1.9999999999"), 2000000000);
  EXPECT_EQ(parsed("1.403715273262142976e+09"), 1403715273262142976);
  EXPECT_EQ(parsed("1.5E-3"), 1500000);
  EXPECT_EQ(parsed("4611686018.427387903"), kMaxStampNs);
}

TEST(Stamp, RefusesWhatIsNoNumber) {
  for (const char* text : {"", ".", "-", "abc", "1.2.3", "1,5", "1e", "1e+", "1e5x", "nan", "0x10", " 1",
                           "4611686018.427387904", "-4611686018.427387904", "1e30"}) {
    std::int64_t stamp = -77;
    EXPECT_FALSE(parse_stamp(text, &stamp)) << text;
    EXPECT_EQ(stamp, -77) << text;
  }
}

TEST(Stamp, FormatsNineDecimals) {
  EXPECT_EQ(format_stamp(0), "0.000000000");
  EXPECT_EQ(format_stamp(1), "0.000000001");
  EXPECT_EQ(format_stamp(-1), "-0.000000001");
  EXPECT_EQ(format_stamp(1403715273262142976), "1403715273.262142976");
  EXPECT_EQ(format_stamp(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
}

TEST(Stamp, ComesBackTheSame) {
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const std::int64_t stamp = static_cast<std::int64_t>(random.next() >> (2 + random.index(60)));
    EXPECT_EQ(parsed(format_stamp(stamp)), stamp);
    EXPECT_EQ(parsed(format_stamp(-stamp)), -stamp);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
