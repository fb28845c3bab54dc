#include "optimization/camera_refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/synthetic_map.h"

namespace mono_pose_tracker {
namespace {

std::vector<Rigid3> straight_ahead() {
  std::vector<Rigid3> poses;
  for (int k = 0; k < 12; ++k) poses.push_back(camera_at({0, 0, 0.02 * k}, 0));
  return poses;
}

TEST(CameraRefinement, FindsTheFocalLengthFromFarOff) {
  const CameraModel truth = synthetic_camera();
  for (const double factor : {0.8, 1.0, 1.3}) {
    // What is left after a first step, a second has: as when a recording is tracked again.
    CameraParameters camera = with_focal(factor);
    CameraRefinement r;
    for (int round = 0; round < 3; ++round) {
      r = refine_camera({}, camera, map_of(round_about(), truth, CameraModel(camera)));
      ASSERT_TRUE(r.focal_observable) << factor << " sigma " << r.focal_sigma;
      camera = r.camera;
    }
    EXPECT_NEAR(camera.fx / truth.parameters().fx, 1, 0.01) << factor;
    EXPECT_NEAR(camera.fx / camera.fy, truth.parameters().fx / truth.parameters().fy, 1e-9);
    EXPECT_LT(r.focal_sigma, 0.01);
  }
}

// The farthest that a pixel of the image's edge lies from where the other camera has it.
double worst_at_edge_px(const CameraModel& a, const CameraModel& b) {
  double worst = 0;
  for (int i = 0; i <= 16; ++i) {
    const double x = (a.width() - 1) * i / 16.0, y = (a.height() - 1) * i / 16.0;
    for (const Eigen::Vector2d& edge : {Eigen::Vector2d(x, 0), Eigen::Vector2d(x, a.height() - 1),
                                        Eigen::Vector2d(0, y), Eigen::Vector2d(a.width() - 1, y)}) {
      Eigen::Vector2d pixel;
      EXPECT_TRUE(b.project(a.bearing(edge), &pixel));
      worst = std::max(worst, (pixel - edge).norm());
    }
  }
  return worst;
}

TEST(CameraRefinement, FindsADistortionThatNobodyTold) {
  CameraParameters lens = synthetic_camera().parameters();
  lens.distortion = {-0.25, 0.08, 0, 0, 0};
  const CameraModel truth(lens);
  CameraParameters camera = synthetic_camera().parameters();
  ASSERT_GT(worst_at_edge_px(truth, CameraModel(camera)), 30);
  CameraRefinementOptions options;
  options.max_landmarks = 1500;  // those that most views see lie in the middle
  for (int round = 0; round < 3; ++round) {
    const CameraRefinement r =
        refine_camera(options, camera, map_of(round_about(), truth, CameraModel(camera), 1500));
    ASSERT_TRUE(r.distortion_observable) << r.focal_sigma;
    camera = r.camera;
  }
  EXPECT_LT(worst_at_edge_px(truth, CameraModel(camera)), 4) << "no point reaches the corners";
  EXPECT_NEAR(camera.fx / lens.fx, 1, 0.005);
}

TEST(CameraRefinement, ItsSigmaIsWhatItIsOffBy) {
  const CameraModel truth = synthetic_camera();
  const CameraRefinement r = refine_camera({}, truth.parameters(), map_of(round_about(), truth, truth));
  ASSERT_TRUE(r.focal_observable);
  EXPECT_LT(std::abs(r.focal_change), 4 * r.focal_sigma);
  EXPECT_GT(r.focal_sigma, 1e-5) << "0.3 px are not nothing";
}

TEST(CameraRefinement, WhatTheMotionDoesNotTellStays) {
  const CameraModel truth = synthetic_camera();
  const CameraParameters given = with_focal(1.2);
  const CameraRefinement r = refine_camera({}, given, map_of(straight_ahead(), truth, CameraModel(given)));
  EXPECT_FALSE(r.focal_observable) << r.focal_sigma << ' ' << r.camera.fx;
  EXPECT_EQ(r.camera, given);
}

TEST(CameraRefinement, TheCameraOfTheImagesFitsBetter) {
  constexpr double kMinExtra = 0.1;
  CameraParameters lens = synthetic_camera().parameters();
  lens.distortion = {-0.2, 0.05, 0, 0, 0};
  const CameraParameters pinhole = synthetic_camera().parameters();
  for (const CameraParameters& truth : {lens, pinhole}) {
    const CameraParameters& other = truth == lens ? pinhole : lens;
    for (const CameraParameters& tracked_with : {lens, pinhole}) {
      const Map map = map_of(round_about(), CameraModel(truth), CameraModel(tracked_with));
      EXPECT_LT(p_value_of_worse_fit({}, other, truth, map, kMinExtra), 1e-6);
      EXPECT_EQ(p_value_of_worse_fit({}, truth, other, map, kMinExtra), 1);
    }
  }
  EXPECT_EQ(p_value_of_worse_fit({}, lens, pinhole, Map(), kMinExtra), 1);
}

TEST(CameraRefinement, AMapOfNothingTellsNothing) {
  const CameraRefinement r = refine_camera({}, synthetic_camera().parameters(), Map());
  EXPECT_FALSE(r.focal_observable);
  EXPECT_EQ(r.camera, synthetic_camera().parameters());
}

}  // namespace
}  // namespace mono_pose_tracker
