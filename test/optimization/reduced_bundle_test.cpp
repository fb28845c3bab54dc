#include "optimization/reduced_bundle.h"

#include <gtest/gtest.h>

#include <optional>

#include "optimization/bundle_solvers.h"
#include "support/bundle_scene.h"

namespace mono_pose_tracker {
namespace {

// Noise of a pixel, one observation in ten off by 20; near to where it fits best.
BundleProblem noisy(std::uint64_t seed, int cameras = 6, int points = 120) {
  BundleProblem problem = scene(cameras, points, 1, seed);
  for (std::size_t i = 0; i < problem.observations.size(); i += 10) {
    BundleObservation& o = problem.observations[i];
    o.bearing = (o.bearing + Eigen::Vector3d(0.04, -0.02, 0)).normalized();
    Eigen::Vector2d pixel;
    bundle_camera().project(o.bearing, &pixel, &o.pixel_from_bearing);
  }
  disturb(&problem, 0.001, seed + 1);
  return problem;
}

BundleOptions to_the_end() {
  BundleOptions options;
  options.max_iterations = 1000;
  options.function_tolerance = 1e-15;
  return options;
}

struct Solved {
  explicit Solved(const BundleProblem& start) : problem(start), cameras(start) {}
  BundleProblem problem;
  BundleCameras cameras;
  BundleReport report;

  bool reduced(const BundleOptions& options) {
    const std::optional<BundleReport> solved = solve_reduced(options, &cameras, &problem);
    report = solved.value_or(BundleReport());
    return solved.has_value();
  }
  void in_full(const BundleOptions& options) { report = solve_in_full(options, &cameras, &problem); }
};

void ends_where_cameras_and_points_together_do(const BundleProblem& noisy_start) {
  for (const bool constant : {false, true}) {
    BundleProblem start = noisy_start;
    start.cameras[2].constant = start.cameras[4].constant = constant;
    Solved full(start), reduced(start);
    full.in_full(to_the_end());
    ASSERT_TRUE(reduced.reduced(to_the_end()));
    EXPECT_NEAR(reduced.report.initial_cost, full.report.initial_cost, 1e-6 * full.report.initial_cost);
    EXPECT_NEAR(reduced.report.final_cost, full.report.final_cost, 1e-6 * full.report.final_cost);
    for (std::size_t i = 0; i < start.cameras.size(); ++i) {
      const Rigid3 a = full.cameras.pose(i), b = reduced.cameras.pose(i);
      EXPECT_LT(rotation_angle_between(a.rotation, b.rotation), 1e-4) << i;
      EXPECT_LT((a.translation - b.translation).norm(), 1e-4) << i;
    }
    for (std::size_t j = 0; j < start.points.size(); ++j) {
      EXPECT_LT((full.problem.points[j] - reduced.problem.points[j]).norm(), 1e-3) << j;
    }
  }
}

TEST(ReducedBundle, EndsWhereCamerasAndPointsTogetherDo) {
  ends_where_cameras_and_points_together_do(noisy(1));
}

TEST(ReducedBundle, EndsWhereTheyDoWithMotionsAsWell) {}

// What is slow is a point's own affair.
TEST(ReducedBundle, FewIterationsComeAsFarAsManyOfCamerasAndPointsTogether) {
  for (std::uint64_t seed = 2; seed < 6; ++seed) {
    BundleOptions options;
    Solved full(noisy(seed)), reduced(noisy(seed));
    options.function_tolerance = 0;
    full.in_full(options);
    options.max_iterations = 7;
    ASSERT_TRUE(reduced.reduced(options));
    EXPECT_LT(reduced.report.final_cost, full.report.final_cost * (1 + 1e-6)) << seed;
  }
}

void has_the_gradient_of_its_cost(const BundleProblem& problem) {
  const BundleCameras cameras(problem);
  ReducedBundle bundle(2, cameras, problem);
  std::vector<double> at;
  for (const int i : cameras.free) at.insert(at.end(), cameras.blocks[i].begin(), cameras.blocks[i].end());
  // Turned, so that the derivatives of turns are not those at none.
  for (std::size_t k = 0; k < at.size(); ++k) at[k] += 0.002 * std::sin(static_cast<double>(k));
  bundle.evaluate(at.data());
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  bundle.linearize(&information, &gradient);
  int held = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    if (cameras.states[cameras.free[k / 6]].held == static_cast<int>(k % 6)) {
      EXPECT_EQ(gradient[k], 0);
      ++held;
      continue;
    }
    constexpr double kStep = 1e-5;
    std::vector<double> less = at, more = at;
    less[k] -= kStep, more[k] += kStep;
    const double slope = (bundle.evaluate(more.data()) - bundle.evaluate(less.data())) / (2 * kStep);
    EXPECT_NEAR(gradient[k], slope, 1e-3 * std::abs(slope) + 1e-3 * gradient.cwiseAbs().maxCoeff()) << k;
  }
  EXPECT_EQ(held, 1) << "the scale";
}

TEST(ReducedBundle, TheGradientIsThatOfTheCost) { has_the_gradient_of_its_cost(noisy(7)); }

TEST(ReducedBundle, AnyNumberOfThreadsGivesTheSameBits) {
  const BundleProblem problem = noisy(12, 10, 400);  // enough for several threads to be worth their while
  ASSERT_GT(problem.observations.size(), 3000u);
  std::optional<Solved> first;
  for (const int threads : {1, 2, 3, 7}) {
    BundleOptions options;
    options.own_threads = threads;
    Solved solved(problem);
    ASSERT_TRUE(solved.reduced(options));
    EXPECT_GT(solved.report.iterations, 1);
    if (!first) first.emplace(solved);
    EXPECT_EQ(solved.problem.points, first->problem.points) << threads;
    for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
      EXPECT_EQ(solved.cameras.blocks[i], first->cameras.blocks[i]) << threads;
    }
  }
}

// Points must not settle for some of the cameras before these have come together.
TEST(ReducedBundle, CamerasThatAreFarOffAreNoneOfItsBusiness) {
  BundleProblem problem = scene(5, 60, 1, 8);
  disturb(&problem, 0.05, 9);
  Solved solved(problem);
  EXPECT_FALSE(solved.reduced(BundleOptions()));
  EXPECT_EQ(solved.problem.points, problem.points);
  EXPECT_TRUE(adjust_bundle(BundleOptions(), &problem).usable);
}

TEST(ReducedBundle, APointThatIsSeenOnceStays) {
  BundleProblem problem = noisy(10);
  const Eigen::Vector3d lonely(0.1, 0.2, 0.3);
  problem.points.push_back(lonely);
  problem.observations.push_back(problem.observations[200]);
  problem.observations.back().point = static_cast<int>(problem.points.size()) - 1;
  Solved solved(problem);
  ASSERT_TRUE(solved.reduced(BundleOptions()));
  EXPECT_EQ(solved.problem.points.back(), lonely);
  EXPECT_LT(solved.report.final_cost, solved.report.initial_cost);
}

}  // namespace
}  // namespace mono_pose_tracker
