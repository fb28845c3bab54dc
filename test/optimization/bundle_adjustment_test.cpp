#include "mono_pose_tracker/optimization/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/random.h"

namespace mono_pose_tracker {
namespace {

CameraModel camera() {
  CameraParameters p;
  p.width = 640, p.height = 480, p.fx = p.fy = 500, p.cx = 320, p.cy = 240;
  p.distortion = {-0.2, 0.05, 0.001, -0.001, 0};
  return CameraModel(p);
}

// Cameras on an arc round a cloud of points, every point seen by all, with noise in px.
BundleProblem scene(int cameras, int points, double noise_px, std::uint64_t seed) {
  Random random(seed);
  const CameraModel model = camera();
  BundleProblem problem;
  for (int i = 0; i < cameras; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    problem.cameras.push_back({Rigid3(turn, Eigen::Vector3d(0, 0, 5)), false});
  }
  while (static_cast<int>(problem.points.size()) < points) {
    problem.points.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  }
  for (int i = 0; i < cameras; ++i) {
    for (int j = 0; j < points; ++j) {
      Eigen::Vector2d pixel;
      EXPECT_TRUE(model.project(problem.cameras[i].camera_from_map * problem.points[j], &pixel));
      pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      BundleObservation o;
      o.camera = i, o.point = j;
      o.bearing = model.bearing(pixel);
      model.project(o.bearing, &pixel, &o.pixel_from_bearing);
      problem.observations.push_back(o);
    }
  }
  return problem;
}

void disturb(BundleProblem* problem, double amount, std::uint64_t seed) {
  Random random(seed);
  const auto noise = [&]() -> Eigen::Vector3d {
    return Eigen::Vector3d(random.normal(), random.normal(), random.normal()) * amount;
  };
  for (std::size_t i = 1; i < problem->cameras.size(); ++i) {
    Rigid3& pose = problem->cameras[i].camera_from_map;
    const Eigen::Vector3d w = noise();
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())) * pose.rotation;
    pose.translation += noise();
  }
  for (Eigen::Vector3d& x : problem->points) x += noise();
}

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

TEST(BundleAdjustment, AnEmptyProblemIsNotUsable) {
  BundleProblem problem;
  EXPECT_FALSE(adjust_bundle(BundleOptions(), &problem).usable);
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

}  // namespace
}  // namespace mono_pose_tracker
