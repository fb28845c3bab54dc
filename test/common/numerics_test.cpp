#include <gtest/gtest.h>

#include "common/rotation.h"
#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

TEST(So3, TurnsAboutTheAxisByTheLength) {
  const double quarter = 1.5707963267948966;
  const Eigen::Vector3d turned = exp_so3({0, 0, quarter}) * Eigen::Vector3d::UnitX();
  EXPECT_LT((turned - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  const Eigen::Vector3d w(0.3, -0.5, 0.7);
  EXPECT_LT((exp_so3(w).toRotationMatrix() - exp_so3_matrix(w)).norm(), 1e-15);
}

TEST(So3, IsItsOwnDerivativeAtZero) {
  const Eigen::Vector3d w(1e-9, -2e-9, 3e-9), x(1, 2, 3);
  EXPECT_LT((exp_so3(w) * x - x - w.cross(x)).norm(), 1e-15);
}

TEST(So3, TheTurnBetweenDirectionsIsTheLeast) {
  const Eigen::Vector3d from(2, 0, 0), to(1, 1, 0);
  const Eigen::AngleAxisd turn(rotation_between(from, to));
  EXPECT_NEAR(turn.angle(), 0.25 * kPi, 1e-12);
  EXPECT_NEAR((turn.axis() - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((rotation_between(to, to) - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
}

TEST(So3, BetweenOppositeDirectionsThereIsATurnAsWell) {
  const Eigen::Vector3d from(0.3, -0.2, 0.9);
  const Eigen::Matrix3d turn = rotation_between(from, -from);
  EXPECT_NEAR((turn * from + from).norm(), 0, 1e-12);
  EXPECT_NEAR(turn.determinant(), 1, 1e-12);
}

TEST(So3, NoTurnIsTheIdentity) {
  EXPECT_EQ(exp_so3_matrix(Eigen::Vector3d::Zero()), Eigen::Matrix3d::Identity());
  EXPECT_EQ(exp_so3(Eigen::Vector3d::Zero()).w(), 1);
  EXPECT_TRUE(exp_so3({1e-320, 0, 0}).coeffs().allFinite());
}

// Two-sided quantiles of Abramowitz and Stegun, table 26.10.
TEST(BinomialTail, IsExact) {
  EXPECT_NEAR(binomial_tail(8, 56, 1.0 / 20), 1.0 / 154, 1e-4);
  EXPECT_EQ(binomial_tail(0, 5, 0.5), 1);
  EXPECT_NEAR(binomial_tail(5, 5, 0.5), 1.0 / 32, 1e-12);
}

// The quantiles of tables.
TEST(StudentTail, IsExact) {
  EXPECT_NEAR(student_tail(12.706, 1), 0.025, 1e-5);
  EXPECT_NEAR(student_tail(4.3027, 2), 0.025, 1e-5);
  EXPECT_NEAR(student_tail(4.5407, 3), 0.01, 1e-5);
  EXPECT_NEAR(student_tail(2.2281, 10), 0.025, 1e-5);
  EXPECT_NEAR(student_tail(-2.2281, 10), 0.975, 1e-5);
  EXPECT_NEAR(student_tail(3.5272, 21), 0.001, 1e-5);
  EXPECT_EQ(student_tail(0, 7), 0.5);
  EXPECT_LT(student_tail(1e6, 40), 1e-12);
  EXPECT_NEAR(student_tail(636.62, 1), 0.0005, 1e-8);
}

}  // namespace

}  // namespace mono_pose_tracker
