#include "robust/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

namespace mono_pose_tracker {
namespace {

TEST(UniformSampler, DrawsEverySetEquallyOften) {
  Random random(1);
  UniformSampler sampler(6, 3);
  std::map<std::set<int>, int> counts;
  const int draws = 40000;
  for (int i = 0; i < draws; ++i) {
    int sample[3];
    sampler.draw(&random, sample);
    counts[std::set<int>(sample, sample + 3)]++;
  }
  ASSERT_EQ(counts.size(), 20u);  // 6 over 3, and so no sample had a datum twice
  double chi_squared = 0;
  for (const auto& [set, count] : counts) {
    chi_squared += std::pow(count - draws / 20.0, 2) / (draws / 20.0);
  }
  EXPECT_LT(chi_squared, 43.8);  // 99.9 % of 19 degrees of freedom
}

TEST(UniformSampler, DrawsAllWhenThereAreNoMore) {
  Random random(2);
  UniformSampler sampler(5, 5);
  int sample[5];
  sampler.draw(&random, sample);
  EXPECT_EQ(std::set<int>(sample, sample + 5), (std::set<int>{0, 1, 2, 3, 4}));
}

TEST(Samplers, RefuseTooFewData) {
  EXPECT_THROW(UniformSampler(4, 5), std::invalid_argument);
  EXPECT_THROW(ProsacSampler(std::vector<float>(4), 5), std::invalid_argument);
}

TEST(ProsacSampler, StartsWithTheBestAndGrows) {
  Random random(3);
  const std::vector<float> quality = {0.9f, 0.1f, 0.5f, std::nanf(""), 0.3f, 0.7f};
  ProsacSampler sampler(quality, 2);
  int sample[2];
  sampler.draw(&random, sample);
  EXPECT_EQ(std::set<int>(sample, sample + 2), (std::set<int>{1, 4}));
  int last_size = sampler.subset_size();
  for (int i = 0; i < 100; ++i) {
    sampler.draw(&random, sample);
    EXPECT_NE(sample[0], sample[1]);
    EXPECT_GE(sampler.subset_size(), last_size);
    last_size = sampler.subset_size();
  }
}

TEST(ProsacSampler, DrawsFromTheBestHalfFarLongerThanChance) {
  Random random(4);
  std::vector<float> quality(200);
  for (int i = 0; i < 200; ++i) {
    quality[i] = static_cast<float>(i);
  }
  ProsacSampler sampler(quality, 5);
  for (int i = 0; i < 50; ++i) {
    int sample[5];
    sampler.draw(&random, sample);
    EXPECT_LT(*std::max_element(sample, sample + 5), 100);  // by chance 1 in 32
  }
}

TEST(ProsacSampler, EndsAsUniform) {
  Random random(5);
  ProsacSampler sampler({5, 4, 3, 2, 1, 0}, 3);
  int sample[3];
  for (int i = 0; i < 200000; ++i) {
    sampler.draw(&random, sample);
  }
  std::vector<int> counts(6, 0);
  const int draws = 30000;
  for (int i = 0; i < draws; ++i) {
    sampler.draw(&random, sample);
    for (const int datum : sample) {
      ++counts[datum];
    }
  }
  for (const int count : counts) {
    EXPECT_NEAR(count, draws / 2.0, 4 * std::sqrt(draws / 4.0));
  }
}

}  // namespace
}  // namespace mono_pose_tracker
