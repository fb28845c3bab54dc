#include "mono_pose_tracker/geometry/five_point.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>
#include <limits>

#include "geometry/essential.h"
#include "geometry/five_point_motion.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

using Problem = TwoViewProblem<5>;

struct Outcome {
  int missed = 0;
  double worst_residual = 0;
};

double residual(const Problem& problem, const Eigen::Matrix3d& e) {
  const Eigen::Matrix3d eet = e * e.transpose();
  double worst = (eet * e - 0.5 * eet.trace() * e).cwiseAbs().maxCoeff();
  worst = std::max(worst, std::abs(e.norm() - 1));
  for (int i = 0; i < 5; ++i) {
    worst = std::max(worst, std::abs(problem.bearings2[i].dot(e * problem.bearings1[i])));
  }
  return worst;
}

Outcome solve(int trials, double tolerance, const std::function<Problem(Random&)>& make) {
  Random random(1);
  Outcome outcome;
  for (int trial = 0; trial < trials; ++trial) {
    const Problem problem = make(random);
    const Eigen::Matrix3d truth = essential_matrix(problem.second_from_first);
    std::array<Eigen::Matrix3d, 10> found;
    const int count = five_point(problem.bearings1, problem.bearings2, &found);
    double best = 2;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, distance_up_to_sign(found[i], truth));
      outcome.worst_residual = std::max(outcome.worst_residual, residual(problem, found[i]));
    }
    outcome.missed += best > tolerance;
  }
  return outcome;
}

constexpr int kTrials = 100000;

TEST(FivePoint, FindsTheTruthInBoxes) {
  for (const double depth_by_width : {0.01, 0.1, 1.0}) {
    const Outcome outcome =
        solve(kTrials, 1e-6, [&](Random& random) { return box_problem<5>(random, depth_by_width); });
    EXPECT_LE(outcome.missed, 3) << depth_by_width;
    EXPECT_LT(outcome.worst_residual, 1e-12) << depth_by_width;
  }
}

TEST(FivePoint, FindsTheTruthForAnyMotion) {
  const Outcome outcome = solve(
      kTrials, 1e-6, [](Random& random) { return motion_problem<5>(random, random_direction(random)); });
  EXPECT_LE(outcome.missed, 3);
  EXPECT_LT(outcome.worst_residual, 1e-12);
}

TEST(FivePoint, FindsTheTruthForSidewaysAndForwardMotion) {
  EXPECT_LE(
      solve(kTrials, 1e-6, [](Random& r) { return motion_problem<5>(r, Eigen::Vector3d::UnitX()); }).missed,
      3);
  EXPECT_LE(
      solve(kTrials, 1e-6, [](Random& r) { return motion_problem<5>(r, Eigen::Vector3d::UnitZ()); }).missed,
      10);  // double precision itself loses some
}

TEST(FivePoint, FindsTheTruthWithoutAnyRotation) {
  // The conditions then have the symmetry of x2 z1 = z2 x1, which the axes of a null space like to follow.
  const auto translated = [](Random& random) {
    Problem problem = motion_problem<5>(random, Eigen::Vector3d::UnitX());
    problem.second_from_first.rotation.setIdentity();
    for (int i = 0; i < 5; ++i) {
      problem.bearings2[i] = (problem.second_from_first * problem.x_in_first[i]).normalized();
    }
    return problem;
  };
  EXPECT_LE(solve(kTrials, 1e-6, translated).missed, 3);
}

TEST(FivePoint, FindsTheTruthWhereTheCameraNearlyOnlyTurns) {
  for (const double baseline : {0.1, 0.01, 0.001}) {
    const auto make = [&](Random& random) { return near_rotation_problem<5>(random, baseline); };
    EXPECT_LE(solve(10000, 1e-5, make).missed, 3) << baseline;
  }
}

struct MotionOutcome {
  int missed = 0, behind = 0;
  double worst_residual = 0;
};

MotionOutcome solve_motions(int trials, const std::function<Problem(Random&)>& make) {
  Random random(2);
  MotionOutcome outcome;
  for (int trial = 0; trial < trials; ++trial) {
    const Problem problem = make(random);
    const Rigid3& truth = problem.second_from_first;
    std::array<Motion, 40> found;
    const int count = five_point(problem.bearings1, problem.bearings2, 0, &found);
    double best = 2;
    for (int i = 0; i < count; ++i) {
      const Rigid3 motion(found[i].rotation, found[i].translation);
      const Eigen::Matrix3d gram = found[i].rotation.transpose() * found[i].rotation;
      double worst = (gram - Eigen::Matrix3d::Identity()).norm() + std::abs(motion.translation.norm() - 1);
      for (int k = 0; k < 5; ++k) {
        outcome.behind += !is_in_front(motion, problem.bearings1[k], problem.bearings2[k]);
        worst = std::max(worst, std::abs(sampson_error(essential_matrix(motion), problem.bearings1[k],
                                                       problem.bearings2[k])));
      }
      outcome.worst_residual = std::max(outcome.worst_residual, worst);
      best = std::min(best, (found[i].rotation - truth.rotation_matrix()).norm() +
                                (found[i].translation - truth.translation.normalized()).norm());
    }
    outcome.missed += best > 1e-4;
  }
  return outcome;
}

TEST(FivePoint, FindsTheMotionWithThePointsInFront) {
  const std::function<Problem(Random&)> makes[] = {
      [](Random& random) { return box_problem<5>(random, 1.0); },
      [](Random& random) { return box_problem<5>(random, 0.01); },
      [](Random& random) { return motion_problem<5>(random, Eigen::Vector3d::UnitZ()); },
      [](Random& random) { return near_rotation_problem<5>(random, 0.01); },
  };
  for (const auto& make : makes) {
    const MotionOutcome outcome = solve_motions(10000, make);
    EXPECT_LE(outcome.missed, 2);
    EXPECT_LT(outcome.worst_residual, 1e-7);
    // Each motion that is returned has them all in front, but for points at an epipole to within rounding.
    EXPECT_LE(outcome.behind, 2);
  }
}

TEST(FivePoint, LetsPointsFallShortByTheTolerance) {
  // Noise of 1e-3 rad about the parallax: the rays of the true motion diverge.
  Random random(6);
  int with_tolerance = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Problem problem = near_rotation_problem<5>(random, 0.01);
    for (Eigen::Vector3d& b : problem.bearings2) b = (b + 1e-3 * random_direction(random)).normalized();
    std::array<Motion, 40> found;
    const int strict = five_point(problem.bearings1, problem.bearings2, 0, &found);
    const int lenient = five_point(problem.bearings1, problem.bearings2, 0.01, &found);
    EXPECT_GE(lenient, strict);
    with_tolerance += lenient > strict;
  }
  EXPECT_GT(with_tolerance, 90);
}

TEST(FivePoint, ReturnsNoSolutionTwice) {
  Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const Problem problem = motion_problem<5>(random, random_direction(random));
    std::array<Eigen::Matrix3d, 10> found;
    const int count = five_point(problem.bearings1, problem.bearings2, &found);
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < i; ++j) EXPECT_GT(distance_up_to_sign(found[i], found[j]), 1e-8);
    }
  }
}

// Near double roots the polynomial's roots are off by its rounding's square root.
TEST(FivePoint, ReturnsNoMotionTwice) {
  Random random(5);
  for (int trial = 0; trial < 20000; ++trial) {
    const Problem problem = near_rotation_problem<5>(random, 0.01);
    std::array<Motion, 40> found;
    const int count = five_point(problem.bearings1, problem.bearings2, 1e-6, &found);
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < i; ++j) {
        EXPECT_GT((found[i].rotation - found[j].rotation).norm() +
                      (found[i].translation - found[j].translation).norm(),
                  1e-7);
      }
    }
  }
}

// The parallax is 1e-8: rounding leaves steps as long.
TEST(FivePoint, PolishesWhereRoundingLeavesLongSteps) {
  Random random(8);
  for (int trial = 0; trial < 100; ++trial) {
    const Problem problem = near_rotation_problem<5>(random, 1e-8);
    const AlignedPairs pairs = align(problem.bearings1, problem.bearings2);
    const Rigid3& truth = problem.second_from_first;
    Motion motion{truth.rotation_matrix() * pairs.turn.transpose(), truth.translation.normalized()};
    EXPECT_LT(polish(pairs, &motion), 0.01);
  }
}

TEST(FivePoint, DoesNotMindTheLengthOfBearings) {
  Random random(2);
  const Problem problem = box_problem<5>(random, 1.0);
  std::array<Eigen::Vector3d, 5> x1, x2;
  for (int i = 0; i < 5; ++i) {
    x1[i] = problem.bearings1[i] / problem.bearings1[i].z();
    x2[i] = -300 * problem.bearings2[i];
  }
  std::array<Eigen::Matrix3d, 10> unit, scaled;
  const int count = five_point(problem.bearings1, problem.bearings2, &unit);
  ASSERT_GT(count, 0);
  ASSERT_EQ(five_point(x1, x2, &scaled), count);
  for (int i = 0; i < count; ++i) {
    double nearest = 2;
    for (int j = 0; j < count; ++j) nearest = std::min(nearest, distance_up_to_sign(unit[i], scaled[j]));
    EXPECT_LT(nearest, 1e-8);
  }
}

TEST(FivePoint, RefusesDegenerateInput) {
  Random random(3);
  std::array<Eigen::Matrix3d, 10> found;
  Problem twice = box_problem<5>(random, 1.0);
  twice.bearings1[4] = twice.bearings1[1];
  twice.bearings2[4] = twice.bearings2[1];
  EXPECT_EQ(five_point(twice.bearings1, twice.bearings2, &found), 0);

  Problem zero = box_problem<5>(random, 1.0);
  zero.bearings1[0].setZero();
  EXPECT_EQ(five_point(zero.bearings1, zero.bearings2, &found), 0);
}

TEST(FivePoint, RefusesNumbersThatAreNotFinite) {
  std::array<Eigen::Matrix3d, 10> found;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Random random(4);
    Problem problem = box_problem<5>(random, 1.0);
    problem.bearings2[3].y() = bad;
    EXPECT_EQ(five_point(problem.bearings1, problem.bearings2, &found), 0);
    std::array<Motion, 40> motions;
    EXPECT_EQ(five_point(problem.bearings1, problem.bearings2, 0.01, &motions), 0);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
