#include "geometry/triangulation.h"

#include <gtest/gtest.h>

#include <limits>

#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

Eigen::Vector3d disturbed(const Eigen::Vector3d& bearing, double sigma, Random& random) {
  return (bearing + sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal())).normalized();
}

double squared_angles(const std::vector<Rigid3>& cameras, const std::vector<Eigen::Vector3d>& bearings,
                      const Eigen::Vector3d& x) {
  double sum = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    sum += ((cameras[i] * x).normalized() - bearings[i]).squaredNorm();
  return sum;
}

TEST(Triangulation, TwoViewsWithoutNoiseGiveThePoint) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto problem = box_problem<1>(random, 1.0);
    Eigen::Vector3d x;
    ASSERT_TRUE(
        triangulate_two_views(problem.second_from_first, problem.bearings1[0], problem.bearings2[0], &x));
    EXPECT_LT((x - problem.x_in_first[0]).norm(), 1e-12);
  }
}

TEST(Triangulation, TwoViewsWithNoiseComeCloseToTheLeastAngles) {
  Random random(2);
  double two_view = 0, optimal = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto problem = motion_problem<1>(random, random_direction(random));
    const std::vector<Rigid3> cameras = {Rigid3(), problem.second_from_first};
    const std::vector<Eigen::Vector3d> bearings = {disturbed(problem.bearings1[0], 1e-3, random),
                                                   disturbed(problem.bearings2[0], 1e-3, random)};
    Eigen::Vector3d quick, best;
    if (!triangulate_two_views(problem.second_from_first, bearings[0], bearings[1], &quick)) continue;
    if (!triangulate_multi_view(cameras, bearings, &best)) continue;
    two_view += squared_angles(cameras, bearings, quick);
    optimal += squared_angles(cameras, bearings, best);
  }
  EXPECT_LE(optimal, two_view * (1 + 1e-9));
  EXPECT_LT(two_view, 1.05 * optimal);
}

TEST(Triangulation, RefusesParallelRaysAndPointsBehind) {
  const Rigid3 sideways(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  const Eigen::Vector3d ahead(0, 0, 1);
  Eigen::Vector3d x;
  EXPECT_FALSE(triangulate_two_views(sideways, ahead, ahead, &x));
  EXPECT_FALSE(triangulate_multi_view({Rigid3(), sideways}, {ahead, ahead}, &x));

  const Eigen::Vector3d left = Eigen::Vector3d(-0.1, 0, 1).normalized(),
                        right = Eigen::Vector3d(0.1, 0, 1).normalized();
  EXPECT_TRUE(triangulate_two_views(sideways, right, left, &x));
  EXPECT_FALSE(triangulate_two_views(sideways, left, right, &x));  // the rays meet behind
  EXPECT_FALSE(triangulate_multi_view({Rigid3(), sideways}, {left, right}, &x));
  const Eigen::Vector3d bad(std::numeric_limits<double>::quiet_NaN(), 0, 1);
  EXPECT_FALSE(triangulate_two_views(sideways, bad, left, &x));
  EXPECT_FALSE(triangulate_multi_view({Rigid3(), sideways}, {bad, left}, &x));
  EXPECT_FALSE(triangulate_multi_view({Rigid3()}, {left}, &x));
}

TEST(Triangulation, ManyViewsReachTheLeastSumOfAngles) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d truth(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(4, 8));
    std::vector<Rigid3> cameras;
    std::vector<Eigen::Vector3d> exact, noisy;
    for (int i = 0; i < 6; ++i) {
      const Eigen::AngleAxisd turn(random.uniform(0, 0.3), random_direction(random));
      cameras.emplace_back(Eigen::Quaterniond(turn), random_direction(random));
      exact.push_back((cameras.back() * truth).normalized());
      noisy.push_back(disturbed(exact.back(), 1e-3, random));
    }
    Eigen::Vector3d x;
    ASSERT_TRUE(triangulate_multi_view(cameras, exact, &x));
    EXPECT_LT((x - truth).norm(), 1e-10);
    ASSERT_TRUE(triangulate_multi_view(cameras, noisy, &x));
    const double least = squared_angles(cameras, noisy, x);
    for (int k = 0; k < 20; ++k) {
      EXPECT_GE(squared_angles(cameras, noisy, x + 1e-4 * random_direction(random)), least);
    }
  }
}

TEST(Triangulation, ParallaxIsTheAngleBetweenTheRays) {
  EXPECT_NEAR(parallax_angle({0, 0, 1}, {0, 0, 0}, {1, 0, 1}), std::acos(0.0), 1e-15);
  EXPECT_NEAR(parallax_angle({0, 0, 1e4}, {0, 0, 0}, {1, 0, 0}), 1e-4, 1e-10);
}

}  // namespace
}  // namespace mono_pose_tracker
