#include "mapping/rigidity_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/angles.h"
#include "support/add_view.h"

namespace mono_pose_tracker {
namespace {

constexpr int kRound = 12, kBoxPoints = 200;

bool is_right(const Eigen::Vector3d& x) { return x.x() > 0.2; }
bool is_above(const Eigen::Vector3d& x) { return x.y() < -0.2; }

// Keyframes around a box of points. Those on one side of the centre may have a motion of their own: `own`
// gives a point's position in keyframe k.
template <typename Motion>
Map make_map(const Motion& own, double noise_px = 0.5,
             bool (*is_in_part)(const Eigen::Vector3d&) = is_right) {
  Random random(11);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kBoxPoints, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kRound; ++k) {
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree);
    SyntheticScene moved = scene;
    for (Eigen::Vector3d& x : moved.x_in_map) {
      if (is_in_part(x)) x = own(k, x);
    }
    add_view(moved, camera, camera_from_map, noise_px, k, ids, random, &map);
  }
  return map;
}

Eigen::Vector3d stays(int, const Eigen::Vector3d& x) { return x; }

// Sways by 0.03 at a distance of 4.5: 4 px.
Eigen::Vector3d sways(int k, const Eigen::Vector3d& x) {
  return x + Eigen::Vector3d(0, (k % 2 ? 0.03 : -0.03), 0);
}

TEST(RigidityCheck, OneRigidObjectAgrees) {
  for (const double noise : {0.2, 0.6, 1.2, 2.4}) {
    const RigidityReport report = check_rigidity(make_map(stays, noise));
    EXPECT_TRUE(report.is_rigid) << noise << " " << report.parts << " " << report.mahalanobis2;
    EXPECT_GT(report.p_value, 0.01) << noise;
    EXPECT_EQ(report.keyframes, kRound);
  }
}

TEST(RigidityCheck, AHalfThatSwaysContradicts) {
  const RigidityReport report = check_rigidity(make_map(sways));
  EXPECT_FALSE(report.is_rigid);
  EXPECT_EQ(report.parts, "left and right");
  EXPECT_LT(report.p_value, 1e-6);
  EXPECT_GT(report.disagreement_px, 1.5);
}

TEST(RigidityCheck, AHeadAboveShouldersContradicts) {
  const auto nods = [](int k, const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return x + Eigen::Vector3d((k % 2 ? 0.03 : -0.03), 0, 0);
  };
  const RigidityReport report = check_rigidity(make_map(nods, 0.5, is_above));
  EXPECT_FALSE(report.is_rigid);
  EXPECT_EQ(report.parts, "upper and lower");
}

// An error of less than a pixel or so may be due to the calibration.
TEST(RigidityCheck, AHalfThatIsOffByAFractionOfAPixelDoesNot) {
  const auto little = [](int k, const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return x + Eigen::Vector3d(0, (k % 2 ? 0.002 : -0.002), 0);
  };
  EXPECT_TRUE(check_rigidity(make_map(little, 0.05)).is_rigid);
}

TEST(RigidityCheck, OfAFewKeyframesNothingCanBeSaid) {
  Map map;
  const RigidityReport report = check_rigidity(map);
  EXPECT_TRUE(report.is_rigid);
  EXPECT_EQ(report.keyframes, 0);
}

}  // namespace
}  // namespace mono_pose_tracker
