#include "robust/accidental_matches.h"

#include <gtest/gtest.h>

#include <vector>

#include "robust/two_view_ambiguity.h"
#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

constexpr double kThreshold = 2 * kPixel;

struct Counts {
  int right = 0, wrong = 0, right_kept = 0, wrong_kept = 0;
};

// Of the pairs near their epipolar lines under the true motion.
Counts counts_of(const TwoViewSceneOptions& options, int scenes) {
  Counts counts;
  for (int seed = 0; seed < scenes; ++seed) {
    const TwoViewScene scene = make_two_view_scene(options, seed);
    const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
    const TwoViewModel truth = model_of(scene.second_from_first);
    std::vector<char> near;
    score_two_views(pairs, truth, kThreshold, kNoBound, &near);
    const PlaneFit plane = fit_plane(pairs.with(near), truth, kThreshold, 0);
    const std::vector<char> flags = more_than_chance(pairs, truth, plane.normal, kThreshold);
    for (int i = 0; i < pairs.size(); ++i) {
      if (!near[i]) continue;
      const bool is_right = scene.is_inlier[pairs.source(i)];
      (is_right ? counts.right : counts.wrong) += 1;
      (is_right ? counts.right_kept : counts.wrong_kept) += flags[i];
    }
  }
  return counts;
}

TEST(AccidentalMatches, WrongPairsNearTheLinesOfAPlaneAreExcluded) {
  TwoViewSceneOptions options;
  options.depth_over_width = 0.01;
  options.outlier_ratio = 0.5;
  const Counts counts = counts_of(options, 200);
  EXPECT_GT(counts.wrong, 50);
  EXPECT_LT(counts.wrong_kept, 0.2 * counts.wrong);
  EXPECT_GT(counts.right_kept, 0.995 * counts.right);
}

// Points at all depths: accidental matches are few among them, and the correct ones are kept.
TEST(AccidentalMatches, WhatIsAtAllDepthsCounts) {
  for (const double outlier_ratio : {0.0, 0.3, 0.7}) {
    TwoViewSceneOptions options;
    options.outlier_ratio = outlier_ratio;
    const Counts counts = counts_of(options, 20);
    EXPECT_GT(counts.right_kept, 0.98 * counts.right) << outlier_ratio;
  }
}

// The second camera is on the plane: the first pair's distance to where the plane maps it is infinite.
TEST(AccidentalMatches, AnInfiniteDistanceIsAFarOne) {
  const TwoViewModel forward{Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ()};
  std::vector<Eigen::Vector3d> first = {Eigen::Vector3d::UnitZ()};
  std::vector<Eigen::Vector3d> second = {Eigen::Vector3d(0.1 * kThreshold, 0, 1).normalized()};
  for (int i = 0; i < 100; ++i) {
    const Eigen::AngleAxisd around(0.06 * i, Eigen::Vector3d::UnitZ());
    const Eigen::AngleAxisd off_line(i % 20 == 0 ? 15 * kThreshold : 0, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d point = around * Eigen::Vector3d(1, 0, 1);
    first.push_back(point.normalized());
    second.push_back(off_line * (point + Eigen::Vector3d::UnitZ()).normalized());
  }
  const BearingPairs pairs(first, second, 0);
  const std::vector<char> flags = more_than_chance(pairs, forward, -Eigen::Vector3d::UnitZ(), kThreshold);
  for (int i = 0; i < pairs.size(); ++i) EXPECT_EQ(flags[i], pairs.source(i) == 0 ? 0 : 1);
}

TEST(AccidentalMatches, AHandfulIsNotSortedOut) {
  TwoViewSceneOptions options;
  options.num_points = 8;
  const Counts counts = counts_of(options, 20);
  EXPECT_GE(counts.right, 100);
  EXPECT_GT(counts.right_kept, 0.8 * counts.right);
}

TEST(AccidentalMatches, WithoutPairsThereAreNoFlags) {
  EXPECT_TRUE(more_than_chance(BearingPairs({}, {}, 0), TwoViewModel(), Eigen::Vector3d::UnitZ(), 1).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
