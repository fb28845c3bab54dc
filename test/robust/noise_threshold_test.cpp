#include "robust/noise_threshold.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

// Errors of two components with unit deviation, as scored within a threshold.
struct Sample {
  RansacScore score;
  int num_data = 0;
  int within(double threshold) const {
    int count = 0;
    for (const double e2 : squares) count += e2 < threshold * threshold;
    return count;
  }
  std::vector<double> squares;
};

Sample sample_of(int count, double threshold, Random* random) {
  Sample sample;
  sample.num_data = count;
  sample.score.cost = 0;
  for (int i = 0; i < count; ++i) {
    const double x = random->normal(), y = random->normal();
    sample.squares.push_back(x * x + y * y);
  }
  sample.score.num_inliers = sample.within(threshold);
  for (const double e2 : sample.squares) sample.score.cost += std::min(e2, threshold * threshold);
  return sample;
}

TEST(NoiseThreshold, LeavesOneOfFourHundredBeyond) {
  Random random(1);
  double sum = 0;
  for (int trial = 0; trial < 200; ++trial) {
    sum += noise_threshold(sample_of(500, 2, &random).score, 500, 2, 2, 0) / 200;
  }
  EXPECT_NEAR(sum, 3.44, 0.05);
}

// The deviation is estimated too: the spread of the count alone would reject one of seven.
TEST(NoiseThreshold, NoiseIsSeldomRejected) {
  constexpr int kTrials = 4000;
  Random random(2);
  for (const int count : {100, 300, 1000}) {
    int rejected = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Sample sample = sample_of(count, 2, &random);
      const double wide = noise_threshold(sample.score, count, 2, 2, 0);
      const int within = sample.within(wide);
      rejected += !noise_explains(within - sample.score.num_inliers, within, 2, wide);
    }
    EXPECT_LT(rejected, 0.06 * kTrials) << count;
  }
}

TEST(NoiseThreshold, AFifthThatIsDisplacedIsNoNoise) {
  constexpr int kTrials = 100;
  Random random(3);
  int rejected = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Sample sample = sample_of(300, 2, &random);
    const double wide = noise_threshold(sample.score, 300, 2, 2, 0);
    const int within = sample.within(wide), displaced = 60;
    rejected += !noise_explains(within - sample.score.num_inliers + displaced, within + displaced, 2, wide);
  }
  EXPECT_GT(rejected, 0.9 * kTrials);
}

TEST(NoiseThreshold, ErrorsWithoutNoiseLeaveTheThreshold) {
  RansacScore score;
  score.cost = 0;
  score.num_inliers = 100;
  EXPECT_EQ(noise_threshold(score, 100, 2, 2, 6), 2);
  EXPECT_TRUE(noise_explains(0, 100, 2, 2));
}

}  // namespace
}  // namespace mono_pose_tracker
