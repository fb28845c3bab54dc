#include "mono_pose_tracker/geometry/p3p.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

double pose_distance(const Motion& a, const Motion& b) {
  return (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm();
}

double pose_distance(const Motion& a, const Rigid3& b) {
  return pose_distance(a, Motion{b.rotation_matrix(), b.translation});
}

/// The largest angle between a bearing and its point, infinite for what is no rotation.
double error_of(const Motion& pose, const PoseProblem& problem) {
  const Eigen::Matrix3d gram = pose.rotation.transpose() * pose.rotation;
  if (!((gram - Eigen::Matrix3d::Identity()).norm() < 1e-8)) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d seen = pose.rotation * problem.points[k] + pose.translation;
    worst =
        std::max(worst, std::atan2(seen.cross(problem.bearings[k]).norm(), seen.dot(problem.bearings[k])));
  }
  return worst;
}

TEST(P3P, FindsTheTruthAndOnlySolutions) {
  Random random(1);
  int missed = 0, duplicates = 0;
  double worst = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const PoseProblem problem = random_pose_problem(random);
    std::array<Motion, 4> found;
    const int count = p3p(problem.bearings, problem.points, &found);
    double best = 10;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, pose_distance(found[i], problem.camera_from_map));
      worst = std::max(worst, error_of(found[i], problem));
      for (int j = 0; j < i; ++j) duplicates += pose_distance(found[i], found[j]) < 1e-7;
    }
    missed += best > 1e-6;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(duplicates, 0);
  EXPECT_LT(worst, 1e-9);
}

TEST(P3P, FindsTheTruthOnTheDangerCylinder) {
  Random random(7);
  constexpr int kTrials = 20000;
  int missed = 0, invalid = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const PoseProblem problem = danger_cylinder_problem(random);
    std::array<Motion, 4> found;
    const int count = p3p(problem.bearings, problem.points, &found);
    double best = 10;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, pose_distance(found[i], problem.camera_from_map));
      invalid += !(error_of(found[i], problem) < 1e-6);
    }
    missed += best > 1e-2;
  }
  EXPECT_LT(missed, 0.02 * kTrials);
  EXPECT_EQ(invalid, 0);
}

// The height is 1e-5 of a side: rounding tilts the triangle by 1e-10 or so, and the start is rough.
TEST(P3P, SolvesNearlyAllFlatTriangles) {
  Random random(7);
  constexpr int kTrials = 20000;
  int unsolved = 0, missed = 0, invalid = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    PoseProblem problem = random_pose_problem(random);
    const Eigen::Vector3d side = problem.points[1] - problem.points[0];
    const Eigen::Vector3d height = 1e-5 * side.cross(random_direction(random));
    problem.points[2] = problem.points[0] + random.uniform(0.1, 0.9) * side + height;
    problem.bearings[2] = (problem.camera_from_map * problem.points[2]).normalized();
    std::array<Motion, 4> found;
    const int count = p3p(problem.bearings, problem.points, &found);
    unsolved += count == 0;
    double best = 10;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, pose_distance(found[i], problem.camera_from_map));
      const Eigen::Matrix3d gram = found[i].rotation.transpose() * found[i].rotation;
      invalid += !((gram - Eigen::Matrix3d::Identity()).norm() < 1e-12 && error_of(found[i], problem) < 1e-7);
    }
    missed += best > 1e-2;
  }
  EXPECT_LE(unsolved, 1);
  EXPECT_LT(missed, 0.006 * kTrials);
  EXPECT_EQ(invalid, 0);
}

TEST(P3P, FindsThreeEqualSides) {
  // Seen along the axis of an equilateral triangle the laws are symmetric: the truth is a multiple root of
  // the cubic.
  PoseProblem problem;
  problem.camera_from_map.translation = Eigen::Vector3d(0, 0, 3);
  for (int i = 0; i < 3; ++i) {
    const double angle = 2 * 3.14159265358979 / 3 * i;
    problem.points[i] = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    problem.bearings[i] = (problem.camera_from_map * problem.points[i]).normalized();
  }
  std::array<Motion, 4> found;
  const int count = p3p(problem.bearings, problem.points, &found);
  double best = 10;
  for (int i = 0; i < count; ++i) best = std::min(best, pose_distance(found[i], problem.camera_from_map));
  EXPECT_LT(best, 1e-6);
}

TEST(P3P, RefusesCollinearAndCoincidentPoints) {
  Random random(2);
  std::array<Motion, 4> found;
  for (int trial = 0; trial < 100; ++trial) {
    PoseProblem problem = random_pose_problem(random);
    PoseProblem collinear = problem;
    collinear.points[2] = 0.3 * collinear.points[0] + 0.7 * collinear.points[1];
    collinear.bearings[2] = (collinear.camera_from_map * collinear.points[2]).normalized();
    EXPECT_EQ(p3p(collinear.bearings, collinear.points, &found), 0);

    PoseProblem coincident = problem;
    coincident.points[1] = coincident.points[0];
    coincident.bearings[1] = coincident.bearings[0];
    EXPECT_EQ(p3p(coincident.bearings, coincident.points, &found), 0);

    PoseProblem parallel = problem;
    parallel.bearings[1] = parallel.bearings[0];
    EXPECT_EQ(p3p(parallel.bearings, parallel.points, &found), 0);
  }
}

TEST(P3P, RefusesNumbersThatAreNotFinite) {
  std::array<Motion, 4> found;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Random random(3);
    PoseProblem problem = random_pose_problem(random);
    PoseProblem bearing = problem, point = problem;
    bearing.bearings[2].z() = bad;
    point.points[0].x() = bad;
    EXPECT_EQ(p3p(bearing.bearings, bearing.points, &found), 0);
    EXPECT_EQ(p3p(point.bearings, point.points, &found), 0);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
