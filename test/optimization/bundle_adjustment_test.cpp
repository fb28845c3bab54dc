#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <glog/logging.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "optimization/bundle_solvers.h"
#include "support/bundle_scene.h"

namespace mono_pose_tracker {
namespace {

TEST(BundleAdjustment, RecoversTheTruthUpToScale) {
  const BundleProblem truth = scene(5, 60, 0, 1);
  BundleProblem problem = truth;
  disturb(&problem, 0.02, 2);
  BundleOptions options;
  options.function_tolerance = 1e-14;
  options.max_iterations = 100;
  const BundleReport report = adjust_bundle(options, &problem);
  EXPECT_TRUE(report.usable);
  EXPECT_LT(report.final_cost, 1e-9);
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    EXPECT_LT(rotation_angle_between(problem.cameras[i].camera_from_map.rotation,
                                     truth.cameras[i].camera_from_map.rotation),
              1e-6);
  }
}

TEST(BundleAdjustment, ConstantCamerasStayAndHoldTheScale) {
  const BundleProblem truth = scene(4, 60, 0, 3);
  BundleProblem problem = truth;
  disturb(&problem, 0.02, 4);
  for (const int i : {0, 3}) problem.cameras[i] = {truth.cameras[i].camera_from_map, true};
  BundleOptions options;
  options.function_tolerance = 1e-14;
  adjust_bundle(options, &problem);
  EXPECT_EQ(problem.cameras[3].camera_from_map.translation, truth.cameras[3].camera_from_map.translation);
  for (std::size_t j = 0; j < truth.points.size(); ++j) {
    EXPECT_LT((problem.points[j] - truth.points[j]).norm(), 1e-6);
  }
}

// With the noise of a real camera the error of the poses stays where least squares puts it.
TEST(BundleAdjustment, OneOutlierInTenDoesLittleHarm) {
  const BundleProblem truth = scene(4, 80, 0.3, 5);
  BundleProblem problem = truth;
  Random random(6);
  for (BundleObservation& o : problem.observations) {
    if (random.uniform() < 0.1)
      o.bearing = (o.bearing + 0.02 * Eigen::Vector3d(random.normal(), random.normal(), 0)).normalized();
  }
  problem.cameras[0].constant = problem.cameras[3].constant = true;
  adjust_bundle(BundleOptions(), &problem);
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    EXPECT_LT(rotation_angle_between(problem.cameras[i].camera_from_map.rotation,
                                     truth.cameras[i].camera_from_map.rotation),
              0.002);
  }
}

TEST(BundleAdjustment, TwoRunsGiveTheSameBytes) {
  BundleProblem a = scene(5, 60, 0.5, 7);
  disturb(&a, 0.02, 8);
  BundleProblem b = a;
  adjust_bundle(BundleOptions(), &a);
  adjust_bundle(BundleOptions(), &b);
  for (std::size_t j = 0; j < a.points.size(); ++j) EXPECT_EQ(a.points[j], b.points[j]);
}

TEST(BundleAdjustment, TheTimeBudgetIsKeptWithinOneIteration) {
  BundleProblem problem = scene(5, 60, 0.5, 9);
  disturb(&problem, 0.02, 10);
  BundleProblem unhurried = problem;
  EXPECT_GT(adjust_bundle(BundleOptions(), &unhurried).iterations, 3);
  BundleOptions options;
  options.max_seconds = 1e-9;  // over before the first step
  const BundleReport report = adjust_bundle(options, &problem);
  EXPECT_TRUE(report.usable);
  EXPECT_LE(report.iterations, 2) << "the start, and the step that was under way";
  EXPECT_LE(report.final_cost, report.initial_cost);
}

TEST(BundleAdjustment, EndsAfterTheIterationInWhichItIsCancelled) {
  BundleProblem problem = scene(5, 60, 0.5, 9);
  disturb(&problem, 0.02, 10);
  BundleOptions options;
  int asked = 0;
  options.cancel = [&] { return ++asked == 2; };
  const BundleReport report = adjust_bundle(options, &problem);
  EXPECT_TRUE(report.cancelled);
  EXPECT_TRUE(report.usable) << "the best so far";
  EXPECT_LT(report.final_cost, report.initial_cost);
  EXPECT_EQ(asked, 2);
  options.cancel = [] { return false; };
  EXPECT_FALSE(adjust_bundle(options, &problem).cancelled);
}

// A point just before one camera, which the first steps take behind it.
void add_point_that_goes_behind(BundleProblem* problem, int camera) {
  const Rigid3 map_from_camera = problem->cameras[camera].camera_from_map.inverse();
  const int point = static_cast<int>(problem->points.size());
  problem->points.push_back(map_from_camera * Eigen::Vector3d(0.01, 0.01, 0.05));
  for (const int seen_by : {camera, camera + 1}) {
    BundleObservation o = problem->observations[seen_by];
    o.camera = seen_by, o.point = point;
    o.bearing = Eigen::Vector3d(0.4 * (seen_by - camera) - 0.2, 0.3, 1).normalized();
    o.pixel_from_bearing << 500, 0, -500 * o.bearing.x() / o.bearing.z(), 0, 500,
        -500 * o.bearing.y() / o.bearing.z();
    o.pixel_from_bearing /= o.bearing.z();
    problem->observations.push_back(o);
  }
}

TEST(BundleAdjustment, APointThatGoesBehindACameraHoldsUpNoOther) {
  const BundleProblem truth = scene(5, 60, 0, 11);
  BundleProblem problem = truth;
  disturb(&problem, 0.02, 12);
  problem.cameras[0].constant = problem.cameras[4].constant = true;
  problem.cameras[4].camera_from_map = truth.cameras[4].camera_from_map;
  BundleProblem alone = problem;
  add_point_that_goes_behind(&problem, 1);
  BundleOptions options;
  options.max_iterations = 8;
  options.function_tolerance = 0;
  ASSERT_TRUE(adjust_bundle(options, &alone).usable);
  ASSERT_TRUE(adjust_bundle(options, &problem).usable);
  for (std::size_t j = 0; j < truth.points.size(); ++j) {
    EXPECT_LT((alone.points[j] - truth.points[j]).norm(), 1e-3);
    EXPECT_LT((problem.points[j] - truth.points[j]).norm(), 1e-3);
  }
}

// Ceres logs what it makes of numbers that are none, and of matrices that it can't decompose.
TEST(BundleAdjustment, NothingIsWrittenToTheTerminal) {
  testing::internal::CaptureStderr();
  for (const double amount : {0.02, 0.5, 3.0}) {
    for (std::uint64_t seed = 1; seed < 5; ++seed) {
      BundleProblem problem = scene(4, 30, 0.5, seed);
      disturb(&problem, amount, seed + 20);
      problem.cameras.push_back({});  // that sees nothing
      problem.points.emplace_back(0, 0, 0);
      problem.points[3] = problem.cameras[1].camera_from_map.inverse().translation;
      problem.observations[0].sigma_px = 0;
      problem.observations[1].bearing.setConstant(std::numeric_limits<double>::quiet_NaN());
      add_point_that_goes_behind(&problem, 1);
      problem.observations.pop_back();  // seen once: its depth is open
      problem.points[7] = Eigen::Vector3d(0, 0, 1e12);
      problem.points[8] = Eigen::Vector3d(0, 0, 1e200);
      BundleOptions options;
      options.max_iterations = 60;
      options.function_tolerance = 0;
      adjust_bundle(options, &problem);
      options.loss_width = 0;
      adjust_bundle(options, &problem);
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// Above 60 cameras the reduced camera matrix is sparse, and another library decomposes it, which has a voice
// of its own.
TEST(BundleAdjustment, NothingIsWrittenToTheTerminalWhereManyCamerasLeaveDirectionsOpen) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  BundleProblem problem = scene(70, 12, 0.5, 3);
  disturb(&problem, 0.05, 4);
  std::vector<BundleObservation> kept;
  for (const BundleObservation& o : problem.observations) {
    if (o.camera % 7 != 3 || o.point == 0) kept.push_back(o);  // every seventh sees a single point
  }
  problem.observations = kept;
  BundleOptions options;
  options.max_iterations = 60;
  options.function_tolerance = 0;
  adjust_bundle(options, &problem);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(BundleAdjustment, ASolveThatFailsLeavesAllAsItWas) {
  BundleProblem problem = scene(4, 30, 0.5, 13);
  disturb(&problem, 0.02, 14);
  problem.points[2].x() = std::numeric_limits<double>::infinity();
  const BundleProblem before = problem;
  const BundleReport report = adjust_bundle(BundleOptions(), &problem);
  EXPECT_FALSE(report.usable);
  EXPECT_TRUE(report.failed);
  for (std::size_t i = 0; i < before.cameras.size(); ++i) {
    EXPECT_EQ(problem.cameras[i].camera_from_map.translation, before.cameras[i].camera_from_map.translation);
  }
  for (std::size_t j = 0; j < before.points.size(); ++j) EXPECT_EQ(problem.points[j], before.points[j]);
}

// Of the camera farthest from the first, the translation's greatest coordinate stays to the last bit.
TEST(BundleAdjustment, TheScaleStaysWithoutConstantCameras) {
  BundleProblem problem = scene(5, 60, 0.5, 15);
  disturb(&problem, 0.02, 16);
  const BundleProblem before = problem;
  const Eigen::Vector3d first = before.cameras[0].camera_from_map.inverse().translation;
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  std::size_t camera = 0;
  for (std::size_t i = 1; i < before.cameras.size(); ++i) {
    const Eigen::Vector3d moved = before.cameras[i].camera_from_map * first;
    if (moved.norm() > farthest.norm()) farthest = moved, camera = i;
  }
  int coordinate = 0;
  farthest.cwiseAbs().maxCoeff(&coordinate);
  ASSERT_TRUE(adjust_bundle(BundleOptions(), &problem).usable);
  const Rigid3 &was = before.cameras[camera].camera_from_map, &is = problem.cameras[camera].camera_from_map;
  // It turns in its place; of its movement this is held.
  const Eigen::Vector3d moved = is.translation - is.rotation * (was.rotation.inverse() * was.translation);
  EXPECT_NEAR(moved[coordinate], 0, 1e-12);
  EXPECT_NE(is.translation, was.translation);
  EXPECT_EQ(problem.cameras[0].camera_from_map.translation, before.cameras[0].camera_from_map.translation);
}

// A map may be large, and its origin far from what is adjusted: that takes as many steps as near it.
TEST(BundleAdjustment, FarFromTheOriginIsAsNearIt) {
  BundleProblem near = scene(5, 60, 0.5, 15);
  disturb(&near, 0.02, 16);
  BundleProblem far = near;
  const Eigen::Vector3d shift(1000, 200, -3000);
  for (BundleCamera& c : far.cameras)
    c.camera_from_map = c.camera_from_map * Rigid3(Eigen::Quaterniond::Identity(), -shift);
  for (Eigen::Vector3d& x : far.points) x += shift;
  const BundleReport near_report = adjust_bundle(BundleOptions(), &near);
  const BundleReport far_report = adjust_bundle(BundleOptions(), &far);
  ASSERT_TRUE(near_report.usable && far_report.usable);
  EXPECT_NEAR(far_report.final_cost, near_report.final_cost, 1e-3 * near_report.final_cost);
  EXPECT_LE(far_report.iterations, near_report.iterations + 1);
  EXPECT_NEAR((far.points[7] - shift - near.points[7]).norm(), 0, 1e-3);
}

TEST(PointAdjustment, EachPointFindsItsPlaceByItself) {
  const BundleProblem truth = scene(4, 60, 0, 17);
  BundleProblem problem = truth;
  for (Eigen::Vector3d& x : problem.points) x += Eigen::Vector3d(0.1, -0.1, 0.2);
  add_point_that_goes_behind(&problem, 1);
  problem.points.emplace_back(0.1, 0.2, 0.3);
  problem.observations.push_back(problem.observations[0]);
  problem.observations.back().point = static_cast<int>(problem.points.size()) - 1;
  const BundleReport report = adjust_points(BundleOptions(), &problem);
  EXPECT_TRUE(report.usable);
  EXPECT_LT(report.final_cost, report.initial_cost);
  for (std::size_t j = 0; j < truth.points.size(); ++j) {
    EXPECT_LT((problem.points[j] - truth.points[j]).norm(), 1e-4) << j;
  }
  EXPECT_EQ(problem.points.back(), Eigen::Vector3d(0.1, 0.2, 0.3)) << "seen once, its depth is open";
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    EXPECT_EQ(problem.cameras[i].camera_from_map.translation, truth.cameras[i].camera_from_map.translation);
  }
}

TEST(PointAdjustment, OneOutlierAmongManyObservationsDoesNotMoveThePoint) {
  BundleProblem problem = scene(8, 20, 0, 18);
  const std::vector<Eigen::Vector3d> truth = problem.points;
  for (std::size_t j = 0; j < truth.size(); ++j) {
    BundleObservation& o = problem.observations[(j % 8) * 20 + j];
    o.bearing = (o.bearing + Eigen::Vector3d(0.05, 0.03, 0)).normalized();
    problem.points[j] += Eigen::Vector3d(0.02, 0.02, -0.02);
  }
  adjust_points(BundleOptions(), &problem);
  for (std::size_t j = 0; j < truth.size(); ++j) EXPECT_LT((problem.points[j] - truth[j]).norm(), 0.003) << j;
}

TEST(BundleAdjustment, AnEmptyProblemIsNotUsable) {
  BundleProblem problem;
  EXPECT_FALSE(adjust_bundle(BundleOptions(), &problem).usable);
  EXPECT_FALSE(adjust_bundle(BundleOptions(), &problem).failed) << "nothing was tried";
}

TEST(BundleAdjustment, OptionsOutOfRangeAreNamed) {
  BundleOptions options;
  options.max_iterations = 0;
  try {
    options.validate();
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("max_iterations"), std::string::npos);
  }
}

// Ceres warns through glog of steps that it takes back: nobody at a terminal can do anything about them.
TEST(BundleAdjustment, WarningsOfTheSolverReachNoTerminal) {
  BundleProblem problem = scene(3, 20, 0.3, 9);
  adjust_bundle(BundleOptions(), &problem);
  testing::internal::CaptureStderr();
  LOG(WARNING) << "Linear solver failure";
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace mono_pose_tracker
