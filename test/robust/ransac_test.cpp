#include "robust/ransac.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "robust/sampler.h"

namespace mono_pose_tracker {
namespace {

// The "model" is a number, the data are numbers; a sample of two equal data proposes their value.
struct MockEstimator {
  using Model = double;
  static constexpr int kSampleSize = 2;
  static constexpr int kMaxModels = 1;

  int num_data() const { return static_cast<int>(data.size()); }

  int solve(const std::array<int, 2>& sample, std::array<double, 1>* models) {
    samples.push_back(sample);
    if (data[sample[0]] != data[sample[1]]) {
      return 0;
    }
    (*models)[0] = data[sample[0]] + offset;
    return 1;
  }

  RansacScore score(const double& model, double cost_bound) const {
    RansacScore score;
    score.cost = 0;
    for (const double datum : data) {
      const double error = std::abs(datum - model);
      score.cost += std::min(error, 1.0);
      score.num_inliers += error < 1.0;
      if (score.cost > cost_bound) {
        break;
      }
    }
    return score;
  }

  void optimize(double* model) const {
    ++optimized;
    *model -= offset;
  }

  bool is_equivalent(const double& a, const double& b) const { return std::abs(a - b) < 0.5; }

  std::vector<double> data;
  double offset = 0;  // how far solve is off what optimize would find
  std::vector<std::array<int, 2>> samples;
  mutable int optimized = 0;
};

// `inliers` data of value 0, the others all different.
MockEstimator mock(int inliers, int outliers) {
  MockEstimator estimator;
  estimator.data.assign(inliers, 0.0);
  for (int i = 0; i < outliers; ++i) {
    estimator.data.push_back(10.0 * (i + 1));
  }
  return estimator;
}

RansacReport<double> run(MockEstimator& estimator, const RansacOptions& options, int num_alternatives = 0) {
  UniformSampler sampler(estimator.num_data(), 2);
  return ransac(options, estimator, sampler, num_alternatives);
}

TEST(RansacIterationsNeeded, IsTheTextbookFormulaForManyData) {
  EXPECT_NEAR(ransac_iterations_needed(500000, 1000000, 5, 0.99), std::log(0.01) / std::log(1 - 1.0 / 32),
              0.1);
  EXPECT_EQ(ransac_iterations_needed(10, 10, 5, 0.99), 1);
  EXPECT_TRUE(std::isinf(ransac_iterations_needed(4, 10, 5, 0.99)));
}

// One set of five in 252 has the five inliers among ten.
TEST(RansacIterationsNeeded, IsExactForFewData) {
  EXPECT_NEAR(ransac_iterations_needed(5, 10, 5, 0.99), std::log(0.01) / std::log(1 - 1.0 / 252), 1e-9);
}

TEST(Ransac, EndsWithTheBestSoFarWhenItIsCancelled) {
  std::atomic<bool> cancelled{false};
  RansacOptions options;
  options.min_iterations = options.max_iterations = 1000;
  options.cancelled = &cancelled;
  MockEstimator estimator = mock(90, 10);
  EXPECT_EQ(run(estimator, options).iterations, 1000);
  cancelled = true;
  const auto report = run(estimator, options);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_EQ(report.best.score.num_inliers, 90);
}

TEST(Ransac, StopsWhenConfident) {
  MockEstimator estimator = mock(50, 50);
  RansacOptions options;
  options.min_iterations = 0;
  options.confidence = 0.99;
  const auto report = run(estimator, options);
  EXPECT_EQ(report.best.model, 0.0);
  EXPECT_EQ(report.best.score.num_inliers, 50);
  // log(0.01) / log(1 - 50 * 49 / (100 * 99)) = 16.2 samples are needed; this seed finds the model among
  // them.
  EXPECT_EQ(report.iterations, 17);
  EXPECT_EQ(static_cast<int>(estimator.samples.size()), report.iterations);
}

TEST(Ransac, FindsTheModelAsOftenAsItsConfidenceSays) {
  RansacOptions options;
  options.min_iterations = 0;
  options.max_iterations = 17;  // a sample of two inliers among 20 + 80: 0.0384 each
  int found = 0;
  const int trials = 4000;
  for (int seed = 0; seed < trials; ++seed) {
    MockEstimator estimator = mock(20, 80);
    options.seed = seed;
    found += run(estimator, options).best.score.num_inliers == 20;
  }
  const double p = 1 - std::pow(1 - 0.2 * 19 / 99, 17);
  EXPECT_NEAR(found / double(trials), p, 4 * std::sqrt(p * (1 - p) / trials));
}

TEST(Ransac, RunsItsLeastAndItsMostIterations) {
  MockEstimator all_inliers = mock(10, 0);
  RansacOptions options;
  options.min_iterations = 30;
  EXPECT_EQ(run(all_inliers, options).iterations, 30);
  MockEstimator no_inliers = mock(0, 50);
  options.max_iterations = 200;
  const auto report = run(no_inliers, options);
  EXPECT_EQ(report.iterations, 200);
  EXPECT_TRUE(std::isinf(report.best.score.cost));
}

TEST(Ransac, ReturnsTheOptimizedModel) {
  MockEstimator estimator = mock(50, 50);
  estimator.offset = 0.3;
  const auto report = run(estimator, RansacOptions());
  EXPECT_EQ(report.best.model, 0.0);
  EXPECT_NEAR(report.best.score.cost, 50.0, 1e-12);
  // Only a better sample is worth optimising, not every one.
  EXPECT_EQ(estimator.optimized, 1);
}

TEST(Ransac, TheSeedDecidesTheSamples) {
  RansacOptions options;
  options.max_iterations = options.min_iterations = 50;
  std::set<std::vector<std::array<int, 2>>> sequences;
  for (int seed = 0; seed < 10; ++seed) {
    options.seed = seed;
    MockEstimator a = mock(60, 140), b = mock(60, 140);
    const auto first = run(a, options), second = run(b, options);
    EXPECT_EQ(a.samples, b.samples);
    EXPECT_EQ(first.best.score.cost, second.best.score.cost);
    sequences.insert(a.samples);
  }
  EXPECT_EQ(sequences.size(), 10u);
}

TEST(Ransac, KeepsAlternativesThatDiffer) {
  MockEstimator estimator;
  estimator.data.assign(40, 0.0);
  estimator.data.insert(estimator.data.end(), 30, 5.0);
  estimator.data.insert(estimator.data.end(), 30, 9.0);
  RansacOptions options;
  options.min_iterations = 200;
  const auto report = run(estimator, options, 2);
  ASSERT_EQ(report.alternatives.size(), 2u);
  EXPECT_EQ(report.alternatives[0].model, 0.0);
  EXPECT_TRUE(report.alternatives[1].model == 5.0 || report.alternatives[1].model == 9.0);
}

TEST(ModelPool, MergesEquivalentModelsAndKeepsTheBest) {
  const auto is_equivalent = [](double a, double b) { return std::abs(a - b) < 1; };
  ModelPool<double> pool(2);
  EXPECT_TRUE(std::isinf(pool.cost_bound()));
  pool.insert({0.0, {5.0, 1}}, is_equivalent);
  pool.insert({0.5, {4.0, 1}}, is_equivalent);  // like the first, and better
  pool.insert({0.2, {4.5, 1}}, is_equivalent);  // like it, and worse
  ASSERT_EQ(pool.models().size(), 1u);
  EXPECT_EQ(pool.models()[0].model, 0.5);
  pool.insert({10.0, {6.0, 1}}, is_equivalent);
  pool.insert({20.0, {3.0, 1}}, is_equivalent);
  ASSERT_EQ(pool.models().size(), 2u);
  EXPECT_EQ(pool.models()[0].model, 20.0);
  EXPECT_EQ(pool.models()[1].model, 0.5);
  EXPECT_EQ(pool.cost_bound(), 4.0);
}

TEST(RansacOptions, RefusesWhatIsOutOfRangeByName) {
  const auto message_of = [](const RansacOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message_of(RansacOptions()), "");
  RansacOptions options;
  options.threshold = 0;
  EXPECT_NE(message_of(options).find("threshold"), std::string::npos);
  options = RansacOptions();
  options.threshold = std::nan("");
  EXPECT_NE(message_of(options).find("threshold"), std::string::npos);
  options = RansacOptions();
  options.confidence = 1;
  EXPECT_NE(message_of(options).find("confidence"), std::string::npos);
  options = RansacOptions();
  options.min_iterations = -1;
  EXPECT_NE(message_of(options).find("min_iterations"), std::string::npos);
  options = RansacOptions();
  options.max_iterations = 49;
  EXPECT_NE(message_of(options).find("max_iterations"), std::string::npos);
}

}  // namespace
}  // namespace mono_pose_tracker
