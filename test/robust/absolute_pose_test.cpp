#include "mono_pose_tracker/robust/absolute_pose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

#include "robust/point_matches.h"
#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

AbsolutePoseOptions default_options(std::uint64_t seed = 0) {
  AbsolutePoseOptions options;
  options.ransac.threshold = 3 * kPixel;
  options.ransac.confidence = 0.999;
  options.ransac.seed = seed;
  return options;
}

TwoViewScene make_scene(double outlier_ratio, double noise, std::uint64_t seed) {
  TwoViewSceneOptions options;
  options.num_points = 300;
  options.outlier_ratio = outlier_ratio;
  options.noise = noise;
  return make_two_view_scene(options, seed);
}

TEST(AbsolutePose, IsExactOnExactMatches) {
  const TwoViewScene scene = make_scene(0.3, 0, 1);
  const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options());
  ASSERT_TRUE(report.success);
  EXPECT_LT(rotation_error(report.camera_from_map, scene.second_from_first), 1e-8);
  EXPECT_LT((report.camera_from_map.translation - scene.second_from_first.translation).norm(), 1e-8);
  EXPECT_EQ(std::count(report.inliers.begin(), report.inliers.end(), 1), report.num_inliers);
  for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
    EXPECT_TRUE(report.inliers[i] || !scene.is_inlier[i]);
  }
}

TEST(AbsolutePose, IsAccurateAtHalfOutliers) {
  std::vector<double> errors;
  for (int seed = 0; seed < 100; ++seed) {
    const TwoViewScene scene = make_scene(0.5, kPixel, seed);
    const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options(seed));
    ASSERT_TRUE(report.success);
    errors.push_back(rotation_error(report.camera_from_map, scene.second_from_first));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[50], 0.04 * kDegree);
  EXPECT_LT(errors.back(), 0.3 * kDegree);
}

// Least squares from the truth over the true inliers is what no method can beat.
TEST(AbsolutePose, IsNearlyAsPreciseAsLeastSquaresOfTheInliers) {
  double found = 0, optimal = 0;
  for (int seed = 0; seed < 200; ++seed) {
    const TwoViewScene scene = make_scene(0.3, kPixel, seed);
    AbsolutePoseOptions options = default_options(seed);
    options.ransac.threshold = 2 * kPixel;
    const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
    ASSERT_TRUE(report.success);
    std::vector<Eigen::Vector3d> bearings, points;
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      if (!scene.is_inlier[i]) continue;
      bearings.push_back(scene.bearings2[i]);
      points.push_back(scene.points_in_first[i]);
    }
    const Rigid3& truth = scene.second_from_first;
    CameraPose optimum{truth.rotation_matrix(), truth.translation};
    refine_camera_pose(PointMatches(bearings, points, 0), 0.4, 50, &optimum);
    found += (report.camera_from_map.translation - truth.translation).squaredNorm();
    optimal += (optimum.translation - truth.translation).squaredNorm();
  }
  EXPECT_LT(found, 1.15 * optimal);
}

// How many of 100 results cost more than the minimum next to the truth, at 80 % outliers.
int stopped_at_worse_minima(double widening) {
  int worse = 0;
  for (int seed = 0; seed < 100; ++seed) {
    const TwoViewScene scene = make_scene(0.8, kPixel, seed);
    AbsolutePoseOptions options = default_options(seed);
    options.ransac.threshold = 2 * kPixel;
    options.widening = widening;
    const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
    const PointMatches matches(scene.bearings2, scene.points_in_first, 0);
    CameraPose best = {scene.second_from_first.rotation_matrix(), scene.second_from_first.translation};
    refine_camera_pose(matches, options.ransac.threshold, 50, &best);
    const double cost = score_camera_pose(matches, best, options.ransac.threshold, kNoBound).cost;
    worse += report.score > (1 + 1e-6) * cost;
  }
  return worse;
}

TEST(AbsolutePose, AWiderThresholdLeadsOutOfLocalMinima) {
  EXPECT_LT(2 * stopped_at_worse_minima(AbsolutePoseOptions().widening), stopped_at_worse_minima(1));
}

// A fifth of the points have drifted, to beyond the threshold, but less far than noise would reach.
TEST(AbsolutePose, PointsThatDriftedHaveNoShare) {
  double found = 0, within_threshold = 0;
  for (int seed = 0; seed < 100; ++seed) {
    TwoViewScene scene = make_scene(0, kPixel, seed);
    const Rigid3& truth = scene.second_from_first;
    const Eigen::Matrix3d drift = Eigen::AngleAxisd(3 * kPixel, Eigen::Vector3d::UnitY()).toRotationMatrix();
    for (int i = 0; i < 60; ++i) scene.bearings2[i] = drift * (truth * scene.points_in_first[i]).normalized();
    AbsolutePoseOptions options = default_options(seed);
    options.ransac.threshold = 2 * kPixel;
    const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
    options.refined_within_noise = false;
    const auto narrow = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
    found += rotation_error(report.camera_from_map, truth);
    within_threshold += rotation_error(narrow.camera_from_map, truth);
  }
  EXPECT_LT(found, 1.1 * within_threshold);
}

// The refined pose fits the matches within the threshold less well: it takes others, too.
TEST(AbsolutePose, RefinementWithinNoiseLeavesScoreAndInliers) {
  const TwoViewScene scene = make_scene(0.3, kPixel, 1);
  AbsolutePoseOptions options = default_options();
  options.ransac.threshold = 2 * kPixel;
  const auto refined = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
  options.refined_within_noise = false;
  const auto narrow = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
  EXPECT_NE(refined.camera_from_map.translation, narrow.camera_from_map.translation);
  EXPECT_EQ(refined.inliers, narrow.inliers);
  EXPECT_EQ(refined.score, narrow.score);
}

TEST(AbsolutePose, SameSeedSameBytes) {
  const TwoViewScene scene = make_scene(0.5, kPixel, 3);
  const auto a = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options(4));
  const auto b = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options(4));
  EXPECT_EQ(a.camera_from_map.rotation.coeffs(), b.camera_from_map.rotation.coeffs());
  EXPECT_EQ(a.camera_from_map.translation, b.camera_from_map.translation);
  EXPECT_EQ(a.inliers, b.inliers);
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST(AbsolutePose, MatchesThatAreNotFiniteAreOutliers) {
  TwoViewScene scene = make_scene(0, kPixel, 5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.bearings2[1].x() = nan;
  scene.points_in_first[2].z() = nan;
  scene.points_in_first[3].y() = std::numeric_limits<double>::infinity();
  const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options());
  ASSERT_TRUE(report.success);
  EXPECT_FALSE(report.inliers[1] || report.inliers[2] || report.inliers[3]);
  EXPECT_LT(rotation_error(report.camera_from_map, scene.second_from_first), 0.2 * kDegree);
}

TEST(AbsolutePose, PointsBehindTheCameraAreOutliers) {
  TwoViewScene scene = make_scene(0, kPixel, 6);
  for (int i = 0; i < 50; ++i) {  // on the bearing's line, on its other side
    scene.points_in_first[i] =
        scene.second_from_first.inverse() * (-(scene.second_from_first * scene.points_in_first[i]));
  }
  const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, default_options());
  ASSERT_TRUE(report.success);
  EXPECT_EQ(std::count(report.inliers.begin(), report.inliers.begin() + 50, 1), 0);
  EXPECT_GT(report.num_inliers, 230);
}

TEST(AbsolutePose, GoodMatchesFirstNeedFewerSamples) {
  const TwoViewScene scene = make_scene(0.9, kPixel, 7);
  AbsolutePoseOptions options = default_options();
  options.ransac.min_iterations = options.ransac.max_iterations = 20;  // by chance a good sample in 1,100
  for (const char inlier : scene.is_inlier) {
    options.quality.push_back(inlier ? 0.5f : 0.7f);
  }
  const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
  ASSERT_TRUE(report.success);
  EXPECT_LT(rotation_error(report.camera_from_map, scene.second_from_first), 0.3 * kDegree);
}

// Half as many matches agree on another motion and rank better: among the best they are the most, so that to
// stop where the best agree would choose that motion.
TEST(AbsolutePose, FindsTheMotionOfMostMatchesThoughAnotherRanksBetter) {
  int right = 0;
  for (int seed = 0; seed < 40; ++seed) {
    TwoViewScene scene = make_scene(0.7, kPixel, seed);
    Random random(seed);
    const Rigid3 other(Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())),
                       Eigen::Vector3d(0.2, 0.1, -0.2));
    AbsolutePoseOptions options = default_options(seed);
    for (std::size_t i = 0; i < scene.is_inlier.size(); ++i) {
      const bool is_of_other = i < 45;
      if (is_of_other) {
        const Eigen::Vector3d y = other * (scene.second_from_first * scene.points_in_first[i]);
        scene.bearings2[i] = add_noise(y.normalized(), kPixel, &random);
      }
      const double mean = is_of_other ? -1 : scene.is_inlier[i] ? 0 : 1.5;
      options.quality.push_back(static_cast<float>(mean + random.normal()));
    }
    const auto report = estimate_absolute_pose(scene.bearings2, scene.points_in_first, options);
    ASSERT_TRUE(report.success);
    right += rotation_error(report.camera_from_map, scene.second_from_first) < kDegree;
  }
  EXPECT_GE(right, 39);
}

TEST(AbsolutePose, FailsWhereThereIsNoPose) {
  EXPECT_FALSE(estimate_absolute_pose({}, {}, default_options()).success);
  const TwoViewScene scene = make_scene(0, kPixel, 8);
  const std::vector<Eigen::Vector3d> same_point(scene.bearings2.size(), Eigen::Vector3d(0, 0, 4));
  EXPECT_FALSE(estimate_absolute_pose(scene.bearings2, same_point, default_options()).success);
}

TEST(AbsolutePose, RefusesBadOptions) {
  const TwoViewScene scene = make_scene(0, kPixel, 9);
  AbsolutePoseOptions options = default_options();
  options.ransac.confidence = 1.5;
  EXPECT_THROW(estimate_absolute_pose(scene.bearings2, scene.points_in_first, options),
               std::invalid_argument);
  options = default_options();
  options.quality.assign(1, 0.f);
  EXPECT_THROW(estimate_absolute_pose(scene.bearings2, scene.points_in_first, options),
               std::invalid_argument);
  EXPECT_THROW(estimate_absolute_pose(scene.bearings2, {}, default_options()), std::invalid_argument);
  options = default_options();
  options.widening = 0.5;
  EXPECT_THROW(estimate_absolute_pose(scene.bearings2, scene.points_in_first, options),
               std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
