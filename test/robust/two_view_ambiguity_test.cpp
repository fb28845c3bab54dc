#include "robust/two_view_ambiguity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <vector>

#include "mono_pose_tracker/robust/relative_pose.h"
#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

double rotation_error(const TwoViewModel& a, const TwoViewModel& b) {
  return rotation_angle_between(Eigen::Quaterniond(a.rotation), Eigen::Quaterniond(b.rotation));
}

double translation_error(const TwoViewModel& a, const TwoViewModel& b) {
  return (a.translation - b.translation).norm();
}

TEST(SecondPlanarSolution, ExplainsThePlaneAndDiffers) {
  const TwoViewModel model =
      model_of(Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.1, 1, 0.3).normalized())),
                      Eigen::Vector3d(1, 0.2, -0.3)));
  const Eigen::Vector3d normal(0.05, -0.1, 0.2);  // 1 / distance in baselines
  TwoViewModel second;
  ASSERT_TRUE(second_planar_solution(model, normal, &second));
  EXPECT_GT(rotation_error(model, second), 1 * kDegree);
  EXPECT_NEAR((second.rotation * second.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
  EXPECT_NEAR(second.rotation.determinant(), 1, 1e-12);
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d x1 = random_bearing(&random);
    const Eigen::Vector3d x2 = (model.rotation * x1 + model.translation * normal.dot(x1)).normalized();
    EXPECT_NEAR(x2.dot(second.translation.cross(second.rotation * x1)), 0, 1e-12);
  }
}

TEST(SecondPlanarSolution, RefusesAPlaneAtInfinity) {
  TwoViewModel second;
  EXPECT_FALSE(second_planar_solution(
      model_of(Rigid3(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d::Zero(), &second));
}

TEST(TurnScaled, ByOneIsTheSameAndReversingTwiceToo) {
  TwoViewSceneOptions options;
  options.noise = 0;
  const TwoViewScene scene = make_two_view_scene(options, 2);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  const TwoViewModel truth = model_of(scene.second_from_first);
  TwoViewModel same, reversed, back;
  ASSERT_TRUE(turn_scaled(pairs, truth, 1, &same));
  EXPECT_NEAR(rotation_error(same, truth), 0, 1e-7);
  EXPECT_NEAR(translation_error(same, truth), 0, 0.05);  // the middle ray of each view is not one point's
  ASSERT_TRUE(turn_scaled(pairs, truth, -1, &reversed));
  EXPECT_GT(rotation_error(reversed, truth), 15 * kDegree);  // turned 10 degrees one way, then the other
  ASSERT_TRUE(turn_scaled(pairs, reversed, -1, &back));
  EXPECT_NEAR(rotation_error(back, truth), 0, 1e-7);
}

TEST(FitPlane, CountsThePointsOnThePlane) {
  TwoViewSceneOptions options;
  options.noise = 0.3 * kPixel;
  TwoViewScene scene = make_two_view_scene(options, 3);
  Random random(4);
  for (int i = 0; i < 300; ++i) {  // of 500
    Eigen::Vector3d& point = scene.points_in_first[i];
    point.z() = 5 + 0.3 * point.x() - 0.2 * point.y();
    scene.bearings1[i] = add_noise(point.normalized(), options.noise, &random);
    scene.bearings2[i] = add_noise((scene.second_from_first * point).normalized(), options.noise, &random);
  }
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  const TwoViewModel truth = model_of(scene.second_from_first);
  const PlaneFit fit = fit_plane(pairs, truth, 2 * kPixel, 0);
  EXPECT_GE(fit.num_inliers, 295);
  EXPECT_LE(fit.num_inliers, 330);
  const Eigen::Vector3d expected = Eigen::Vector3d(-0.3, 0.2, 1).normalized();
  EXPECT_LT(std::acos(std::min(1.0, fit.normal.normalized().dot(expected))), 1 * kDegree);
}

TEST(FitPlane, NeedsThreePoints) {
  const TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 3);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  std::vector<char> two(pairs.size(), 0);
  two[0] = two[1] = 1;
  const PlaneFit fit = fit_plane(pairs.with(two), model_of(scene.second_from_first), kPixel, 0);
  EXPECT_EQ(fit.num_inliers, 0);
  EXPECT_EQ(fit.normal, Eigen::Vector3d::Zero());
}

// An object that fills 11 degrees of the view and turns by 8: depth reversed fits nearly as well.
TEST(NarrowView, TheTruthIsAmongTheHypotheses) {
  int best_is_true = 0;
  const int trials = 40;
  for (int seed = 0; seed < trials; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(8 * kDegree, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Vector3d center(0, 0, 10);
    const Rigid3 truth(turn, center - turn * center);
    std::vector<Eigen::Vector3d> bearings1, bearings2;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d point =
          center + Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-0.7, 0.7));
      const Eigen::Vector3d other =
          i % 5 == 0 ? center + Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0)
                     : truth * point;
      bearings1.push_back(add_noise(point.normalized(), 0.5 * kPixel, &random));
      bearings2.push_back(add_noise(other.normalized(), 0.5 * kPixel, &random));
    }
    RelativePoseOptions options;
    options.ransac.threshold = 1.5 * kPixel;
    options.ransac.seed = seed;
    const RelativePoseReport report = estimate_relative_pose(bearings1, bearings2, options);
    ASSERT_TRUE(report.success);
    double nearest = std::numeric_limits<double>::infinity();
    for (const RelativePoseHypothesis& hypothesis : report.hypotheses) {
      nearest =
          std::min(nearest, rotation_angle_between(hypothesis.second_from_first.rotation, truth.rotation));
    }
    EXPECT_LT(nearest, 2.5 * kDegree) << "seed " << seed;
    best_is_true += rotation_angle_between(report.hypotheses[0].second_from_first.rotation, truth.rotation) <
                    2.5 * kDegree;
  }
  EXPECT_GE(best_is_true, trials * 9 / 10);
}

}  // namespace
}  // namespace mono_pose_tracker
