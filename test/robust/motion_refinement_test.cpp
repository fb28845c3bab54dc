#include "robust/motion_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

TwoViewScene make_motion_scene(double outlier_ratio, double noise, std::uint64_t seed) {
  TwoViewSceneOptions options;
  options.num_points = 100;
  options.outlier_ratio = outlier_ratio;
  options.noise = noise;
  return make_two_view_scene(options, seed);
}

Rigid3 disturbed(const Rigid3& pose, double angle, double shift) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, -2, 0.5).normalized()));
  return Rigid3(turn * pose.rotation, turn * pose.translation + shift * Eigen::Vector3d(0.3, -0.5, 0.8));
}

// v, w of estimate = exp(w) truth + v.
Eigen::Matrix<double, 6, 1> perturbation(const Rigid3& estimate, const Rigid3& truth) {
  const Eigen::AngleAxisd turn(estimate.rotation * truth.rotation.conjugate());
  Eigen::Matrix<double, 6, 1> result;
  result << estimate.translation - turn.toRotationMatrix() * truth.translation, turn.angle() * turn.axis();
  return result;
}

TEST(MotionRefinement, FindsTheExactPose) {
  const TwoViewScene scene = make_motion_scene(0, 0, 1);
  MotionRefinementOptions options;
  options.max_iterations = 30;
  const auto report =
      refine_absolute_pose(scene.bearings2, scene.points_in_first, std::vector<double>(100, kPixel),
                           disturbed(scene.second_from_first, 0.02, 0.1), options);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(perturbation(report.camera_from_map, scene.second_from_first).norm(), 1e-6);
  EXPECT_LT(report.final_cost, 1e-6);
}

TEST(MotionRefinement, CovarianceIsThatOfTheErrors) {
  const int trials = 400;
  double mean_nees = 0, mean_nees_unknown_sigma = 0;
  for (int seed = 0; seed < trials; ++seed) {
    const TwoViewScene scene = make_motion_scene(0, kPixel, seed);
    const Rigid3 start = disturbed(scene.second_from_first, 0.002, 0.01);
    // A sigma that is half the truth: the variance factor has to make up for it.
    const auto report =
        refine_absolute_pose(scene.bearings2, scene.points_in_first, std::vector<double>(100, 0.5 * kPixel),
                             start, MotionRefinementOptions());
    ASSERT_TRUE(report.converged);
    const auto error = perturbation(report.camera_from_map, scene.second_from_first);
    mean_nees += error.dot(report.covariance.ldlt().solve(error)) / trials;
    const auto unknown =
        refine_absolute_pose(scene.bearings2, scene.points_in_first, {}, start, MotionRefinementOptions());
    ASSERT_TRUE(unknown.converged);
    const auto unknown_error = perturbation(unknown.camera_from_map, scene.second_from_first);
    mean_nees_unknown_sigma += unknown_error.dot(unknown.covariance.ldlt().solve(unknown_error)) / trials;
  }
  // Chi squared of 6 degrees of freedom has mean 6; its mean over the trials deviates by 0.17.
  EXPECT_NEAR(mean_nees, 6, 0.8);
  EXPECT_NEAR(mean_nees_unknown_sigma, 6, 0.8);
}

TEST(MotionRefinement, OutliersHardlyMoveIt) {
  const TwoViewScene scene = make_motion_scene(0.2, kPixel, 4);
  const std::vector<double> sigmas(100, kPixel);
  const Rigid3 start = disturbed(scene.second_from_first, 0.005, 0.02);
  MotionRefinementOptions options;
  options.max_iterations = 30;
  const auto report = refine_absolute_pose(scene.bearings2, scene.points_in_first, sigmas, start, options);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(rotation_error(report.camera_from_map, scene.second_from_first), 0.2 * kDegree);
  EXPECT_GT(report.covariance.diagonal().minCoeff(), 0);
}

TEST(MotionRefinement, ExcludesNonFiniteInput) {
  TwoViewScene scene = make_motion_scene(0, kPixel, 5);
  scene.bearings2[7].z() = std::numeric_limits<double>::quiet_NaN();
  scene.points_in_first[8].x() = std::numeric_limits<double>::infinity();
  const auto report =
      refine_absolute_pose(scene.bearings2, scene.points_in_first, std::vector<double>(100, kPixel),
                           scene.second_from_first, MotionRefinementOptions());
  EXPECT_TRUE(report.converged);
  EXPECT_LT(rotation_error(report.camera_from_map, scene.second_from_first), 0.2 * kDegree);
}

TEST(MotionRefinement, DoesNotConvergeOnTooFewMatches) {
  const TwoViewScene scene = make_motion_scene(0, kPixel, 6);
  const std::vector<Eigen::Vector3d> bearings(scene.bearings2.begin(), scene.bearings2.begin() + 2);
  const std::vector<Eigen::Vector3d> points(scene.points_in_first.begin(), scene.points_in_first.begin() + 2);
  const auto report =
      refine_absolute_pose(bearings, points, {}, scene.second_from_first, MotionRefinementOptions());
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.covariance.norm(), 0);
}

TEST(MotionRefinement, RefusesBadOptions) {
  const TwoViewScene scene = make_motion_scene(0, kPixel, 7);
  MotionRefinementOptions options;
  options.loss_width = 0;
  EXPECT_THROW(refine_absolute_pose(scene.bearings2, scene.points_in_first, {}, Rigid3(), options),
               std::invalid_argument);
  options = MotionRefinementOptions();
  options.max_iterations = 0;
  EXPECT_THROW(refine_absolute_pose(scene.bearings2, scene.points_in_first, {}, Rigid3(), options),
               std::invalid_argument);
  EXPECT_THROW(refine_absolute_pose(scene.bearings2, scene.points_in_first, {1.0}, Rigid3(),
                                    MotionRefinementOptions()),
               std::invalid_argument);
  EXPECT_THROW(refine_absolute_pose(scene.bearings2, scene.points_in_first, std::vector<double>(100, -1.0),
                                    Rigid3(), MotionRefinementOptions()),
               std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
