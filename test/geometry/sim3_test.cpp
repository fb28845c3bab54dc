#include "mono_pose_tracker/geometry/sim3.h"

#include <gtest/gtest.h>

#include <limits>

#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

std::vector<Eigen::Vector3d> random_points(int count, Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(random.normal(), random.normal(), random.normal());
  return points;
}

TEST(Sim3, RecoversATransform) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    Sim3 truth;
    truth.scale = std::exp(random.uniform(-5, 5));
    truth.rotation = random_rotation(random);
    truth.translation = 10 * random_direction(random);
    const std::vector<Eigen::Vector3d> a = random_points(trial == 0 ? 3 : 20, random);
    std::vector<Eigen::Vector3d> b;
    for (const Eigen::Vector3d& x : a) b.push_back(truth * x);
    Sim3 found;
    ASSERT_TRUE(align_sim3(a, b, &found));
    EXPECT_NEAR(found.scale / truth.scale, 1, 1e-12);
    EXPECT_LT(found.rotation.angularDistance(truth.rotation), 1e-7);
    EXPECT_LT((found.translation - truth.translation).norm(), 1e-10 * (1 + truth.scale));
  }
}

TEST(Sim3, IsAGroup) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Sim3 b_from_a(std::exp(random.uniform(-2, 2)), random_rotation(random), random_direction(random));
    const Sim3 c_from_b(std::exp(random.uniform(-2, 2)), random_rotation(random), random_direction(random));
    const Eigen::Vector3d x = random_direction(random);
    EXPECT_LT((c_from_b * b_from_a * x - c_from_b * (b_from_a * x)).norm(), 1e-12);
    EXPECT_LT((b_from_a.inverse() * (b_from_a * x) - x).norm(), 1e-13);
  }
}

TEST(Sim3, RefusesTooFewPointsAndCoincidentOnes) {
  Random random(2);
  Sim3 found;
  EXPECT_FALSE(align_sim3(random_points(2, random), random_points(2, random), &found));
  EXPECT_FALSE(align_sim3(random_points(4, random), random_points(5, random), &found));
  const std::vector<Eigen::Vector3d> same(5, Eigen::Vector3d(1.1, 2.2, 3.3));
  EXPECT_FALSE(align_sim3(same, random_points(5, random), &found));
  EXPECT_FALSE(align_sim3(random_points(5, random), same, &found));
  std::vector<Eigen::Vector3d> bad = random_points(5, random);
  bad[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(align_sim3(bad, random_points(5, random), &found));
}

}  // namespace
}  // namespace mono_pose_tracker
