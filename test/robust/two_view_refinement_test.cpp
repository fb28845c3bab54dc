#include "robust/two_view_refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

// Only with right derivatives do six steps end at the exact pose.
TEST(RefineTwoViews, ConvergesAsNewtonDoes) {
  TwoViewSceneOptions options;
  options.noise = 0;
  const TwoViewScene scene = make_two_view_scene(options, 5);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  const TwoViewModel truth = model_of(scene.second_from_first);
  TwoViewModel model = truth;
  model.rotation = Eigen::AngleAxisd(1 * kDegree, Eigen::Vector3d(1, 2, -1).normalized()) * model.rotation;
  model.translation = (model.translation + Eigen::Vector3d(0.02, -0.03, 0.05)).normalized();
  EXPECT_LT(refine_two_views(pairs, 0.1, 6, &model), 1e-18);
  EXPECT_LT((model.rotation - truth.rotation).norm(), 1e-9);
  EXPECT_LT((model.translation - truth.translation).norm(), 1e-8);
}

// Scoring counts pairs behind a camera as outliers: so must refining.
TEST(RefineTwoViews, LowersTheCostThatScoringSees) {
  for (int seed = 0; seed < 20; ++seed) {
    TwoViewSceneOptions options;
    options.outlier_ratio = 0.5;
    options.depth_over_width = 0.01;
    const TwoViewScene scene = make_two_view_scene(options, seed);
    const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
    TwoViewModel model = model_of(scene.second_from_first);
    model.rotation = Eigen::AngleAxisd(0.1 * kDegree, Eigen::Vector3d::UnitX()) * model.rotation;
    const double before = score_two_views(pairs, model, 2 * kPixel, kNoBound).cost;
    const double reached = refine_two_views(pairs, 2 * kPixel, 20, &model);
    const double after = score_two_views(pairs, model, 2 * kPixel, kNoBound).cost;
    EXPECT_LT(after, before) << seed;
    EXPECT_NEAR(reached, after, 1e-9 * after) << seed;
  }
}

// Least squares from the truth over the true inliers is what no method can beat.
TEST(PolishTwoViews, IsNearlyAsPreciseAsLeastSquaresOfTheInliers) {
  double cut = 0, polished = 0, optimal = 0;
  for (int seed = 0; seed < 60; ++seed) {
    TwoViewSceneOptions options;
    options.outlier_ratio = 0.3;
    const TwoViewScene scene = make_two_view_scene(options, seed);
    const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
    std::vector<Eigen::Vector3d> inliers1, inliers2;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      if (!scene.is_inlier[i]) continue;
      inliers1.push_back(scene.bearings1[i]);
      inliers2.push_back(scene.bearings2[i]);
    }
    const TwoViewModel truth = model_of(scene.second_from_first);
    const auto squared_error = [&](const TwoViewModel& model) {
      return model.translation.cross(truth.translation).squaredNorm();
    };
    TwoViewModel model = truth;
    refine_two_views(BearingPairs(inliers1, inliers2, 0), 0.4, 50, &model);
    optimal += squared_error(model);
    model = truth;
    refine_two_views(pairs, 1.5 * kPixel, 50, &model);
    cut += squared_error(model);
    polish_two_views(pairs, 1.5 * kPixel, 50, &model);
    polished += squared_error(model);
  }
  EXPECT_LT(polished, 1.35 * optimal);
  EXPECT_LT(polished, 0.8 * cut);
}

// Along the flat valley of an almost planar scene the truncated cost has many minima: from a pose at the
// valley's side, as a minimal sample gives it, refining ends in one of them.
TEST(ExploreTwoViews, LeavesLocalMinima) {
  constexpr int kScenes = 60;
  std::vector<double> refined, explored;
  int lower = 0;
  for (int seed = 0; seed < kScenes; ++seed) {
    TwoViewSceneOptions options;
    options.outlier_ratio = 0.5;
    options.depth_over_width = 0.01;
    const TwoViewScene scene = make_two_view_scene(options, seed);
    const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
    const TwoViewModel truth = model_of(scene.second_from_first);
    TwoViewModel model = truth;
    model.rotation = Eigen::AngleAxisd(0.5 * kDegree, Eigen::Vector3d::UnitY()) * model.rotation;
    model.translation = Eigen::AngleAxisd(5 * kDegree, Eigen::Vector3d::UnitY()) * model.translation;
    const double cost = refine_two_views(pairs, 2 * kPixel, 25, &model);
    refined.push_back(model.translation.cross(truth.translation).norm());
    explore_two_views(pairs, 2 * kPixel, 10, 1, &model);
    explored.push_back(model.translation.cross(truth.translation).norm());
    const double reached = score_two_views(pairs, model, 2 * kPixel, kNoBound).cost;
    EXPECT_LE(reached, cost * (1 + 1e-9)) << seed;
    lower += reached < 0.999 * cost;
  }
  std::sort(refined.begin(), refined.end());
  std::sort(explored.begin(), explored.end());
  EXPECT_GT(lower, kScenes / 4);
  EXPECT_LT(explored[kScenes * 9 / 10], 0.8 * refined[kScenes * 9 / 10]);
}

TEST(ExploreTwoViews, NeedsNoMoreThanAFewPairs) {
  TwoViewSceneOptions options;
  options.num_points = 6;
  const TwoViewScene scene = make_two_view_scene(options, 1);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  TwoViewModel model = model_of(scene.second_from_first);
  explore_two_views(pairs, 2 * kPixel, 10, 1, &model);
  EXPECT_LT(model.translation.cross(model_of(scene.second_from_first).translation).norm(), 0.1);
  EXPECT_NEAR(model.rotation.determinant(), 1, 1e-9);
}

}  // namespace
}  // namespace mono_pose_tracker
