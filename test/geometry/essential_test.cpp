#include "geometry/essential.h"

#include <gtest/gtest.h>

#include <limits>

#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

TEST(Essential, HasUnitNormAndHoldsForItsPairs) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const auto problem = motion_problem<5>(random, 7 * random_direction(random));
    const Eigen::Matrix3d e = essential_matrix(problem.second_from_first);
    EXPECT_NEAR(e.norm(), 1, 1e-14);
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(problem.bearings2[i].dot(e * problem.bearings1[i]), 0, 1e-14);
  }
}

TEST(Essential, DecomposesIntoFourPosesOfWhichCheiralityKeepsTheTrueOne) {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto problem = motion_problem<5>(random, random_direction(random));
    std::array<Rigid3, 4> poses;
    ASSERT_TRUE(decompose_essential(-3 * essential_matrix(problem.second_from_first), &poses));
    int in_front = 0;
    for (const Rigid3& pose : poses) {
      EXPECT_NEAR(pose.translation.norm(), 1, 1e-14);
      EXPECT_LT(distance_up_to_sign(essential_matrix(pose), essential_matrix(problem.second_from_first)),
                1e-13);
      bool all = true;
      for (int i = 0; i < 5; ++i) all = all && is_in_front(pose, problem.bearings1[i], problem.bearings2[i]);
      if (!all) continue;
      ++in_front;
      EXPECT_LT(rotation_angle_between(pose.rotation, problem.second_from_first.rotation), 1e-7);
      EXPECT_LT((pose.translation - problem.second_from_first.translation).norm(), 1e-12);
    }
    EXPECT_EQ(in_front, 1);
  }
}

TEST(Essential, RefusesZeroAndNumbersThatAreNotFinite) {
  std::array<Rigid3, 4> poses;
  EXPECT_FALSE(decompose_essential(Eigen::Matrix3d::Zero(), &poses));
  EXPECT_FALSE(
      decompose_essential(Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN()), &poses));
}

TEST(Essential, SampsonErrorIsTheLeastTurnOfThePairInRadians) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    auto problem = motion_problem<5>(random, random_direction(random));
    const Eigen::Matrix3d e = essential_matrix(problem.second_from_first);
    const Eigen::Vector3d& b1 = problem.bearings1[0];
    Eigen::Vector3d& b2 = problem.bearings2[0];
    EXPECT_NEAR(sampson_error(e, b1, b2), 0, 1e-14);
    b2 = (b2 + 1e-4 * random_direction(random)).normalized();
    const double error = sampson_error(e, b1, b2);
    // Moving both bearings along the gradient by the error brings them onto the epipolar surface.
    Eigen::Vector3d gradient1 = e.transpose() * b2, gradient2 = e * b1;
    gradient1 -= gradient1.dot(b1) * b1;
    gradient2 -= gradient2.dot(b2) * b2;
    const double length = std::sqrt(gradient1.squaredNorm() + gradient2.squaredNorm());
    const Eigen::Vector3d moved1 = (b1 - error / length * gradient1).normalized();
    const Eigen::Vector3d moved2 = (b2 - error / length * gradient2).normalized();
    EXPECT_NEAR(sampson_error(e, moved1, moved2), 0, 1e-6 * std::abs(error) + 1e-8);
  }
}

TEST(Essential, PointsBehindEitherCameraAreNotInFront) {
  const Rigid3 sideways(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0));
  const auto seen = [&](const Eigen::Vector3d& x, double sign1, double sign2) {
    return is_in_front(sideways, sign1 * x.normalized(), sign2 * (sideways * x).normalized());
  };
  const Eigen::Vector3d x(0.3, 0.2, 4);
  EXPECT_TRUE(seen(x, 1, 1));
  EXPECT_FALSE(seen(x, -1, 1));
  EXPECT_FALSE(seen(x, 1, -1));
  EXPECT_FALSE(seen(x, -1, -1));
}

}  // namespace
}  // namespace mono_pose_tracker
