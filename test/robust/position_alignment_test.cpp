#include "robust/position_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/rotation.h"
#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

const Sim3 kWorldFromMap(7.5, Eigen::Quaterniond(0.8, 0.3, -0.4, 0.2).normalized(), {400, -300, 120});

/// A drive of a hundred metres with a bend, in map units.
Eigen::Vector3d on_path(double t) { return {10 * std::sin(t), 0.05 * t, 10 * t + 2 * t * t}; }

std::vector<PositionPair> measured(int count, double noise, double outlier_share) {
  Random random(3);
  std::vector<PositionPair> pairs;
  for (int i = 0; i < count; ++i) {
    PositionPair pair;
    pair.in_map = on_path(1.5 * i / count);
    pair.in_world = kWorldFromMap * pair.in_map;
    for (int axis = 0; axis < 3; ++axis) pair.in_world[axis] += noise * random.normal();
    if (random.uniform() < outlier_share) {
      for (int axis = 0; axis < 3; ++axis) pair.in_world[axis] += random.uniform(-100, 100);
    }
    pairs.push_back(pair);
  }
  return pairs;
}

double worst_distance(const Sim3& found, const std::vector<PositionPair>& pairs) {
  double worst = 0;
  for (const PositionPair& pair : pairs) {
    worst = std::max(worst, (found * pair.in_map - kWorldFromMap * pair.in_map).norm());
  }
  return worst;
}

TEST(PositionAlignment, ExactPositionsGiveTheSimilarity) {
  const auto pairs = measured(50, 0, 0);
  const PositionAlignment found = align_positions(pairs, {}, {});
  ASSERT_TRUE(found.success) << found.problem;
  EXPECT_NEAR(found.world_from_map.scale, 7.5, 1e-9);
  EXPECT_LT(worst_distance(found.world_from_map, pairs), 1e-6);
  EXPECT_EQ(found.num_inliers, 50);
}

TEST(PositionAlignment, NoiseOfTwoMetresAndOutliers) {
  for (double share : {0.1, 0.3}) {
    const auto pairs = measured(200, 2, share);
    const PositionAlignment found = align_positions(pairs, {}, {});
    ASSERT_TRUE(found.success) << found.problem;
    EXPECT_LT(worst_distance(found.world_from_map, pairs), 1.5) << share;
    EXPECT_NEAR(found.sigma, 2, 0.3) << share;
    EXPECT_NEAR(found.world_from_map.scale / 7.5, 1, 4 * found.scale_sigma);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double off = (pairs[i].in_world - kWorldFromMap * pairs[i].in_map).norm();
      if (off > 12) {
        EXPECT_FALSE(found.inliers[i]) << off;
      } else if (off < 4) {
        EXPECT_TRUE(found.inliers[i]) << off;
      }
    }
  }
}

TEST(PositionAlignment, CoordinatesAreFarFromTheOrigin) {
  auto pairs = measured(100, 2, 0.1);
  const Eigen::Vector3d far(4.5e5, 5.4e6, 100);  // UTM
  for (PositionPair& pair : pairs) pair.in_world += far;
  const PositionAlignment found = align_positions(pairs, {}, {});
  ASSERT_TRUE(found.success) << found.problem;
  EXPECT_NEAR(found.world_from_map.scale, 7.5, 0.3);
}

TEST(PositionAlignment, ALineLeavesTheRotationToTheDirections) {
  std::vector<PositionPair> pairs;
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    PositionPair pair;
    pair.in_map = {0, 0, 0.1 * i};
    pair.in_world = kWorldFromMap * pair.in_map;
    for (int axis = 0; axis < 3; ++axis) pair.in_world[axis] += 0.5 * random.normal();
    pairs.push_back(pair);
  }
  const PositionAlignment open = align_positions(pairs, {}, {});
  ASSERT_TRUE(open.success) << open.problem;
  EXPECT_FALSE(open.used_directions);
  EXPECT_GT(open.rotation_sigma_deg, 30);
  const Eigen::Vector3d down = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d down_in_world = kWorldFromMap.rotation * down;
  const PositionAlignment known = align_positions(pairs, {{down, down_in_world}}, {});
  ASSERT_TRUE(known.success) << known.problem;
  EXPECT_TRUE(known.used_directions);
  EXPECT_LT(known.world_from_map.rotation.angularDistance(kWorldFromMap.rotation) / kDegree, 1);
  // A direction along the path that contradicts it is not used.
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(align_positions(pairs, {{ahead, down_in_world}}, {}).used_directions);
}

TEST(PositionAlignment, FourPositionsAreEnough) {
  for (const int count : {4, 5, 6}) {
    const auto pairs = measured(count, 0.05, 0);
    const PositionAlignment found = align_positions(pairs, {}, {});
    ASSERT_TRUE(found.success) << found.problem;
    EXPECT_EQ(found.num_inliers, count);
    EXPECT_NEAR(found.world_from_map.scale / 7.5, 1, 0.05);
  }
}

TEST(PositionAlignment, SaysWhyThereIsNone) {
  const auto problem = [](const std::vector<PositionPair>& pairs) {
    const PositionAlignment found = align_positions(pairs, {}, {});
    EXPECT_FALSE(found.success);
    return found.problem;
  };
  EXPECT_NE(problem(measured(3, 0, 0)).find("expected at least 4"), std::string::npos);
  EXPECT_NE(problem(std::vector<PositionPair>(10)).find("coincide"), std::string::npos);
  auto nonsense = measured(40, 0, 0);
  Random random(1);
  for (PositionPair& pair : nonsense) pair.in_world = {random.normal(), random.normal(), random.normal()};
  EXPECT_FALSE(problem(nonsense).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
