#include "mono_pose_tracker/robust/early_rejection.h"

#include <gtest/gtest.h>

#include <limits>

#include "mono_pose_tracker/common/random.h"

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

TEST(EarlyRejection, NeedsABound) {
  EXPECT_FALSE(is_hopeless(1.0, 64, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(is_hopeless(0.9, 64, 1.0));
}

}  // namespace
}  // namespace mono_pose_tracker
