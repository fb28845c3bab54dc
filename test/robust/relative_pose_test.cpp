#include "mono_pose_tracker/robust/relative_pose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "common/rotation.h"
#include "robust/two_view_refinement.h"
#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

RelativePoseOptions relative_options(std::uint64_t seed = 0) {
  RelativePoseOptions options;
  options.ransac.threshold = 2 * kPixel;
  options.ransac.confidence = 0.999;
  options.ransac.seed = seed;
  return options;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

TEST(RelativePose, IsExactOnExactMatches) {
  TwoViewSceneOptions scene_options;
  scene_options.noise = 0;
  scene_options.outlier_ratio = 0.3;
  const TwoViewScene scene = make_two_view_scene(scene_options, 1);
  const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options());
  ASSERT_TRUE(report.success);
  const RelativePoseHypothesis& best = report.hypotheses[0];
  EXPECT_LT(rotation_error(best.second_from_first, scene.second_from_first), 1e-6);
  EXPECT_LT(direction_error(best.second_from_first, scene.second_from_first), 1e-6);
  EXPECT_NEAR(best.second_from_first.translation.norm(), 1, 1e-12);
  for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
    EXPECT_TRUE(best.inliers[i] || !scene.is_inlier[i]);
  }
  EXPECT_EQ(std::count(best.inliers.begin(), best.inliers.end(), 1), best.num_inliers);
}

TEST(RelativePose, IsAccurateAtHalfOutliers) {
  TwoViewSceneOptions scene_options;
  scene_options.outlier_ratio = 0.5;
  std::vector<double> rotation_errors, direction_errors;
  for (int seed = 0; seed < 60; ++seed) {
    const TwoViewScene scene = make_two_view_scene(scene_options, seed);
    const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options(seed));
    ASSERT_TRUE(report.success);
    rotation_errors.push_back(
        rotation_error(report.hypotheses[0].second_from_first, scene.second_from_first));
    direction_errors.push_back(
        direction_error(report.hypotheses[0].second_from_first, scene.second_from_first));
  }
  EXPECT_LT(median(rotation_errors), 0.13 * kDegree);
  EXPECT_LT(median(direction_errors), 0.28 * kDegree);
  EXPECT_LT(*std::max_element(rotation_errors.begin(), rotation_errors.end()), 1 * kDegree);
}

TEST(RelativePose, NeverTakesTheSecondSolutionOfAnAlmostPlanarScene) {
  TwoViewSceneOptions scene_options;
  scene_options.depth_over_width = 0.01;
  scene_options.outlier_ratio = 0.3;
  for (int seed = 0; seed < 60; ++seed) {
    const TwoViewScene scene = make_two_view_scene(scene_options, seed);
    const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options(seed));
    ASSERT_TRUE(report.success);
    EXPECT_LT(rotation_error(report.hypotheses[0].second_from_first, scene.second_from_first), 2.5 * kDegree)
        << "seed " << seed;
    EXPECT_GT(report.plane_inliers, 0.7 * report.hypotheses[0].num_inliers);
  }
}

// Least squares from the truth over the true pairs is what no method can beat. Where the scene hardly tells
// the direction, pairs that are near the lines by chance must not.
TEST(RelativePose, APlaneSeenWithHalfOutliersIsAsPreciseAsWithout) {
  std::vector<double> errors, optima;
  for (int seed = 0; seed < 100; ++seed) {
    TwoViewSceneOptions scene_options;
    scene_options.outlier_ratio = 0.5;
    scene_options.depth_over_width = 0.01;
    const TwoViewScene scene = make_two_view_scene(scene_options, seed);
    const TwoViewModel truth = model_of(scene.second_from_first);
    std::vector<Eigen::Vector3d> right1, right2;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      if (!scene.is_inlier[i]) continue;
      right1.push_back(scene.bearings1[i]);
      right2.push_back(scene.bearings2[i]);
    }
    TwoViewModel optimum = truth;
    refine_two_views(BearingPairs(right1, right2, 0), 0.4, 50, &optimum);
    const RelativePoseReport report =
        estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options());
    ASSERT_TRUE(report.success);
    const Eigen::Vector3d& found = report.hypotheses.front().second_from_first.translation;
    errors.push_back(angle_between(found, truth.translation));
    optima.push_back(angle_between(optimum.translation, truth.translation));
  }
  EXPECT_LT(median(errors), 1.2 * median(optima));
}

TEST(RelativePose, HypothesesAreDistinctAndSorted) {
  TwoViewSceneOptions scene_options;
  scene_options.depth_over_width = 0.01;
  const TwoViewScene scene = make_two_view_scene(scene_options, 5);
  const RelativePoseOptions options = relative_options();
  const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, options);
  ASSERT_GE(report.hypotheses.size(), 2u);
  EXPECT_LE(static_cast<int>(report.hypotheses.size()), options.max_hypotheses);
  for (std::size_t i = 0; i < report.hypotheses.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Rigid3& a = report.hypotheses[i].second_from_first;
      const Rigid3& b = report.hypotheses[j].second_from_first;
      EXPECT_LE(report.hypotheses[j].score, report.hypotheses[i].score);
      EXPECT_TRUE(rotation_error(a, b) >= options.distinct_rotation ||
                  direction_error(a, b) >= options.distinct_translation);
    }
  }
}

// After few samples the best motion often is the plane's other one, until ambiguous motions are weighed.
TEST(RelativePose, CountsThePlaneOfTheBestMotion) {
  int right = 0, missed = 0;
  for (int seed = 0; seed < 100; ++seed) {
    TwoViewSceneOptions scene_options;
    scene_options.depth_over_width = 0.01;
    scene_options.outlier_ratio = 0.3;
    const TwoViewScene scene = make_two_view_scene(scene_options, seed);
    RelativePoseOptions options = relative_options(seed);
    options.ransac.min_iterations = 1;
    options.ransac.max_iterations = 5;
    const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, options);
    if (!report.success) continue;
    const RelativePoseHypothesis& best = report.hypotheses[0];
    if (rotation_error(best.second_from_first, scene.second_from_first) > 0.5 * kDegree) continue;
    ++right;
    missed += report.plane_inliers < 0.7 * best.num_inliers;
  }
  EXPECT_GT(right, 60);
  EXPECT_LE(missed, 4);
}

TEST(RelativePose, SaysWhenThereIsOnlyARotation) {
  TwoViewSceneOptions scene_options;
  scene_options.outlier_ratio = 0.2;
  TwoViewScene scene = make_two_view_scene(scene_options, 3);
  Random random(4);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(8 * kDegree, Eigen::Vector3d(0.1, 1, 0.2).normalized()));
  for (std::size_t i = 0; i < scene.bearings1.size(); ++i) {
    if (scene.is_inlier[i]) {
      scene.bearings2[i] = add_noise(turn * scene.bearings1[i], kPixel, &random);
    }
  }
  const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options());
  ASSERT_TRUE(report.success);
  EXPECT_GT(report.rotation_only_inliers, 0.85 * report.hypotheses[0].num_inliers);
  EXPECT_LT(rotation_angle_between(report.rotation_only, turn), 0.1 * kDegree);

  const TwoViewScene moving = make_two_view_scene(TwoViewSceneOptions(), 3);
  const auto moving_report = estimate_relative_pose(moving.bearings1, moving.bearings2, relative_options());
  EXPECT_LT(moving_report.rotation_only_inliers, 0.3 * moving_report.hypotheses[0].num_inliers);
  EXPECT_LT(moving_report.plane_inliers, 0.3 * moving_report.hypotheses[0].num_inliers);
}

TEST(RelativePose, SameSeedSameBytes) {
  TwoViewSceneOptions scene_options;
  scene_options.outlier_ratio = 0.4;
  const TwoViewScene scene = make_two_view_scene(scene_options, 7);
  const auto a = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options(9));
  const auto b = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options(9));
  ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
  EXPECT_EQ(a.iterations, b.iterations);
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    EXPECT_EQ(a.hypotheses[i].second_from_first.rotation.coeffs(),
              b.hypotheses[i].second_from_first.rotation.coeffs());
    EXPECT_EQ(a.hypotheses[i].second_from_first.translation, b.hypotheses[i].second_from_first.translation);
    EXPECT_EQ(a.hypotheses[i].inliers, b.hypotheses[i].inliers);
    EXPECT_EQ(a.hypotheses[i].score, b.hypotheses[i].score);
  }
}

TEST(RelativePose, BearingsThatAreNotFiniteAreOutliers) {
  TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 8);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.bearings1[3] = Eigen::Vector3d(nan, 0, 1);
  scene.bearings2[5] = Eigen::Vector3d(std::numeric_limits<double>::infinity(), 0, 1);
  scene.bearings2[6] = Eigen::Vector3d::Zero();
  const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options());
  ASSERT_TRUE(report.success);
  EXPECT_FALSE(report.hypotheses[0].inliers[3]);
  EXPECT_FALSE(report.hypotheses[0].inliers[5]);
  EXPECT_FALSE(report.hypotheses[0].inliers[6]);
  EXPECT_LT(rotation_error(report.hypotheses[0].second_from_first, scene.second_from_first), 0.5 * kDegree);
}

TEST(RelativePose, GoodMatchesFirstNeedFewerSamples) {
  TwoViewSceneOptions scene_options;
  scene_options.outlier_ratio = 0.7;
  const TwoViewScene scene = make_two_view_scene(scene_options, 11);
  RelativePoseOptions options = relative_options();
  options.ransac.max_iterations = 50;  // by chance a good sample in 412
  for (const char inlier : scene.is_inlier) {
    options.quality.push_back(inlier ? 0.5f : 0.7f);
  }
  const auto report = estimate_relative_pose(scene.bearings1, scene.bearings2, options);
  ASSERT_TRUE(report.success);
  EXPECT_LT(rotation_error(report.hypotheses[0].second_from_first, scene.second_from_first), 1 * kDegree);
}

TEST(RelativePose, FailsOnTooFewMatches) {
  TwoViewSceneOptions scene_options;
  scene_options.num_points = 5;
  const TwoViewScene scene = make_two_view_scene(scene_options, 1);
  EXPECT_FALSE(estimate_relative_pose(scene.bearings1, scene.bearings2, relative_options()).success);
  EXPECT_FALSE(estimate_relative_pose({}, {}, relative_options()).success);
}

TEST(RelativePose, RefusesBadOptions) {
  const TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 1);
  RelativePoseOptions options = relative_options();
  options.ransac.threshold = -1;
  EXPECT_THROW(estimate_relative_pose(scene.bearings1, scene.bearings2, options), std::invalid_argument);
  options = relative_options();
  options.max_hypotheses = 0;
  EXPECT_THROW(estimate_relative_pose(scene.bearings1, scene.bearings2, options), std::invalid_argument);
  options = relative_options();
  options.quality.assign(3, 1.0f);
  EXPECT_THROW(estimate_relative_pose(scene.bearings1, scene.bearings2, options), std::invalid_argument);
  EXPECT_THROW(estimate_relative_pose(scene.bearings1, {}, relative_options()), std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
