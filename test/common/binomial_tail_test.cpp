#include "common/statistics.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(BinomialTail, IsExact) {
  EXPECT_NEAR(binomial_tail(8, 56, 1.0 / 20), 1.0 / 154, 1e-4);
  EXPECT_EQ(binomial_tail(0, 5, 0.5), 1);
  EXPECT_NEAR(binomial_tail(5, 5, 0.5), 1.0 / 32, 1e-12);
}

}  // namespace
}  // namespace mono_pose_tracker
