#include <gtest/gtest.h>

#include <cstdint>
#include <optional>

#include "common/text.h"

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

template <typename T>
std::optional<T> parsed(const std::string& text) {
  T value{};
  return parse_decimal(text, &value) ? std::optional<T>(value) : std::nullopt;
}

TEST(Decimal, WholeNumbers) {
  EXPECT_EQ(parsed<int>("0"), 0);
  EXPECT_EQ(parsed<int>("+42"), 42);
  EXPECT_EQ(parsed<int>("-2147483648"), -2147483647 - 1);
  EXPECT_EQ(parsed<std::uint64_t>("18446744073709551615"), 18446744073709551615u);
  for (const char* text :
       {"", "-", "+", " 1", "1 ", "0100", "-01", "0x10", "1.0", "1e3", "2147483648", "1_000", "--1"}) {
    EXPECT_FALSE(parsed<int>(text)) << text;
  }
  EXPECT_FALSE(parsed<std::uint64_t>("-1"));
  EXPECT_FALSE(parsed<std::uint64_t>("18446744073709551616"));
}

TEST(Decimal, Reals) {
  EXPECT_EQ(parsed<double>("0.25"), 0.25);
  EXPECT_EQ(parsed<double>("-.5"), -0.5);
  EXPECT_EQ(parsed<double>("5."), 5.0);
  EXPECT_EQ(parsed<double>("1.5e-06"), 1.5e-6);
  EXPECT_EQ(parsed<float>("+1E3"), 1000.f);
  for (const char* text :
       {"", ".", "-", "nan", ".nan", "inf", "-.inf", "1e999", "0x1p3", "1,5", "00.5", "1e", "1 2"}) {
    EXPECT_FALSE(parsed<double>(text)) << text;
  }
}

}  // namespace

}  // namespace mono_pose_tracker
