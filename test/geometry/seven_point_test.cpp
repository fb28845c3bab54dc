#include "mono_pose_tracker/geometry/seven_point.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "geometry/essential.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

TEST(SevenPoint, FindsTheTruth) {
  Random random(1);
  int missed = 0;
  double worst_residual = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const auto problem = motion_problem<7>(random, random_direction(random));
    const Eigen::Matrix3d truth = essential_matrix(problem.second_from_first);
    std::array<Eigen::Matrix3d, 3> found;
    const int count = seven_point(problem.bearings1, problem.bearings2, &found);
    double best = 2;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, distance_up_to_sign(found[i], truth));
      worst_residual =
          std::max({worst_residual, std::abs(found[i].norm() - 1), std::abs(found[i].determinant())});
      for (int k = 0; k < 7; ++k) {
        worst_residual =
            std::max(worst_residual, std::abs(problem.bearings2[k].dot(found[i] * problem.bearings1[k])));
      }
    }
    missed += best > 1e-6;
  }
  EXPECT_LE(missed, 1);
  EXPECT_LT(worst_residual, 1e-12);
}

TEST(SevenPoint, RefusesDegenerateInput) {
  Random random(2);
  std::array<Eigen::Matrix3d, 3> found;
  // Seven points of a plane fulfil six independent conditions.
  const auto plane = box_problem<7>(random, 0.0);
  EXPECT_EQ(seven_point(plane.bearings1, plane.bearings2, &found), 0);

  auto twice = box_problem<7>(random, 1.0);
  twice.bearings1[6] = twice.bearings1[2];
  twice.bearings2[6] = twice.bearings2[2];
  EXPECT_EQ(seven_point(twice.bearings1, twice.bearings2, &found), 0);
}

TEST(SevenPoint, RefusesNumbersThatAreNotFinite) {
  std::array<Eigen::Matrix3d, 3> found;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Random random(3);
    auto problem = box_problem<7>(random, 1.0);
    problem.bearings1[5].x() = bad;
    EXPECT_EQ(seven_point(problem.bearings1, problem.bearings2, &found), 0);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
