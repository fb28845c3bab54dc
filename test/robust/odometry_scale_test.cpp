#include "robust/odometry_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

constexpr double kMetresPerUnit = 1.7;

Eigen::Quaterniond turn(const Eigen::Vector3d& axis, double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

// A robot on a curve, the camera ahead of its axis, and what wheels and tracker say of it.
struct Drive {
  Random random{5};
  double noise = 0.02;  // of each step's length, odometry's
  double slip = 1;      // by which odometry's steps are too long
  Rigid3 base_from_camera{turn({1, 0.2, 0.1}, -1.6), {0.6, 0.1, 0.4}};
  Rigid3 map_from_odom{turn({0.3, 1, 0.2}, 2.0), {3, -1, 2}};
  Rigid3 true_base, odom_base;  // odom_from_base

  void step(double metres, double radians) {
    const auto gaussian = [&] { return random.normal(); };
    true_base = true_base * Rigid3(turn({0, 0, 1}, radians), {metres, 0, 0});
    const double length = metres * slip * (1 + noise * gaussian());
    odom_base = odom_base * Rigid3(turn({0, 0, 1}, radians * (1 + noise * gaussian())), {length, 0, 0});
  }
  Rigid3 odom_from_camera() const { return odom_base * base_from_camera; }
  Rigid3 map_from_camera() const {
    Rigid3 pose = map_from_odom * true_base * base_from_camera;
    pose.translation /= kMetresPerUnit;
    return pose;
  }
  void drive(int steps, OdometryScale* scale) {
    for (int i = 0; i < steps; ++i) {
      step(0.03, 0.02 * std::sin(0.1 * i));
      scale->add(odom_from_camera(), map_from_camera());
    }
  }
};

TEST(OdometryScale, NoisyOdometryOfTheFirstMetresGivesItWithinTwoPerCent) {
  for (int seed = 1; seed <= 20; ++seed) {
    Drive drive;
    drive.random = Random(seed);
    OdometryScale scale;
    std::optional<double> factor;
    int steps = 0;
    for (; steps < 200 && !factor; ++steps) {
      drive.drive(1, &scale);
      factor = scale.correction(false);
    }
    ASSERT_TRUE(factor) << "after 6 m, seed " << seed;
    EXPECT_GE(steps, 45) << "not before ten segments";
    EXPECT_NEAR(*factor, kMetresPerUnit, 0.02 * kMetresPerUnit) << "seed " << seed;
  }
}

TEST(OdometryScale, ACameraOffTheAxisOfABaseThatTurnsIsMovedByIt) {
  Drive drive;
  OdometryScale scale;
  for (int i = 0; i < 80; ++i) {
    drive.step(0, 0.05);
    scale.add(drive.odom_from_camera(), drive.map_from_camera());
  }
  const auto found = scale.estimate();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->metres_per_unit, kMetresPerUnit, 0.02 * kMetresPerUnit);
  EXPECT_FALSE(OdometryScale().estimate()) << "and one that stands still tells nothing";
}

TEST(OdometryScale, WheelsThatSlipAQuarterOfTheWayDoNotCount) {
  Drive drive;
  OdometryScale scale;
  drive.drive(60, &scale);
  drive.slip = 2;
  drive.drive(20, &scale);
  drive.slip = 1;
  drive.drive(40, &scale);
  const auto found = scale.estimate();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->metres_per_unit, kMetresPerUnit, 0.02 * kMetresPerUnit);
}

// A live map is adjusted every ten keyframes: what was measured before counts on.
TEST(OdometryScale, AMapThatIsAdjustedNowAndThenDoesNotKeepItFromMeasuring) {
  Drive drive;
  OdometryScale scale;
  double correction = 1;
  for (int i = 0; i < 200; ++i) {
    drive.step(0.03, 0.01);
    Rigid3 map_from_camera = drive.map_from_camera();
    map_from_camera.translation *= correction;
    scale.add(drive.odom_from_camera(), map_from_camera);
    if (i % 10 != 9) continue;
    EXPECT_TRUE(scale.follow(1.002));
    correction *= 1.002;
  }
  const auto found = scale.estimate();
  ASSERT_TRUE(found);
  // By 0.2 % twenty times: what is measured is the map as it is now.
  EXPECT_NEAR(found->metres_per_unit, kMetresPerUnit / correction, 0.01 * kMetresPerUnit);
  EXPECT_FALSE(scale.follow(1.02)) << "a loop was closed";
  EXPECT_FALSE(scale.estimate());
}

TEST(OdometryScale, TransformsThatDoNotFitGiveNothing) {
  Drive drive;
  OdometryScale scale;
  for (int i = 0; i < 120; ++i) {
    drive.step(0.03, 0);
    const Rigid3 wrong = drive.odom_base * Rigid3(turn({0, 1, 0}, 1.0), Eigen::Vector3d::Zero());
    scale.add(wrong, drive.map_from_camera());
  }
  EXPECT_FALSE(scale.estimate());
}

TEST(OdometryScale, AMapInMetresIsLeftAloneUnlessItIsOffByThreePerCent) {
  for (const double off : {1.02, 0.98, 1.05, 0.94}) {
    Drive drive;
    drive.noise = 0.005;
    OdometryScale scale;
    for (int i = 0; i < 120; ++i) {
      drive.step(0.03, 0.01);
      Rigid3 map_from_camera = drive.map_from_camera();
      map_from_camera.translation *= kMetresPerUnit / off;
      scale.add(drive.odom_from_camera(), map_from_camera);
    }
    const std::optional<double> factor = scale.correction(true);
    ASSERT_EQ(factor.has_value(), std::abs(off - 1) > 0.03) << off;
    if (factor) {
      EXPECT_NEAR(*factor, off, 0.01);
    }
    scale.restart();
    EXPECT_FALSE(scale.estimate());
  }
}

}  // namespace
}  // namespace mono_pose_tracker
