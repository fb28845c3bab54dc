#include "robust/early_rejection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

// Share of models with the given outlier ratio (cost 1 an outlier, 0 an inlier) given up within 512 data,
// tested every 64.
double share_given_up(double outlier_ratio, double bound) {
  Random random(1);
  const int trials = 4000;
  int given_up = 0;
  for (int trial = 0; trial < trials; ++trial) {
    int cost = 0;
    for (int count = 1; count <= 512; ++count) {
      cost += random.uniform() < outlier_ratio;
      if (count % 64 == 0 && is_hopeless(cost / double(count), count, bound)) {
        ++given_up;
        break;
      }
    }
  }
  return given_up / double(trials);
}

TEST(EarlyRejection, HardlyEverGivesUpWhatIsAsGood) {
  for (const double bound : {0.2, 0.5, 0.8}) {
    EXPECT_LT(share_given_up(bound, bound), 0.02);
    EXPECT_LT(share_given_up(bound - 0.1, bound), 0.001);
  }
}

TEST(EarlyRejection, GivesUpWhatIsFarWorse) {
  EXPECT_GT(share_given_up(0.95, 0.5), 0.999);
  EXPECT_GT(share_given_up(0.95, 0.7), 0.999);
}

// All 64 outliers have a probability of 0.9^64 = 1/848 where a tenth are inliers, of 1/28 where a twentieth
// are.
TEST(EarlyRejection, CountsExactlyWhereNearlyAllAreOutliers) {
  EXPECT_TRUE(is_hopeless(1.0, 64, 0.9));
  EXPECT_FALSE(is_hopeless(1.0, 60, 0.9));
  EXPECT_FALSE(is_hopeless(1.0, 64, 0.95));
  EXPECT_TRUE(is_hopeless(1.0, 20, 0.7));
  EXPECT_LT(share_given_up(0.9, 0.9), 0.02);
}

// 0.9^28 = 1/19, 0.9^29 = 1/21.
TEST(EarlyRejection, TakesTheOddsThatItIsGiven) {
  const double once_in_20 = std::log(20.0);
  EXPECT_FALSE(is_hopeless(1.0, 28, 0.9, once_in_20));
  EXPECT_TRUE(is_hopeless(1.0, 29, 0.9, once_in_20));
}

TEST(EarlyRejection, NeedsABound) {
  EXPECT_FALSE(is_hopeless(1.0, 64, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(is_hopeless(0.9, 64, 1.0));
  EXPECT_FALSE(is_hopeless(1.0, 64, 1.0));
}

}  // namespace
}  // namespace mono_pose_tracker
