#include "mapping/motion_segmentation.h"

#include <gtest/gtest.h>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

struct Bearings {
  std::vector<Eigen::Vector3d> first, second;
};

// Bearings of a head of half a unit from 6 units away, before and after its rotation.
Bearings of_head(double turned_rad) {
  Random random(5);
  Bearings bearings;
  for (const Eigen::Vector3d& x : synthetic_head(60, random).x_in_map) {
    bearings.first.push_back((before_turned_head(0) * x).normalized());
    bearings.second.push_back((before_turned_head(turned_rad) * x).normalized());
  }
  return bearings;
}

TEST(RotationInView, IsAboutAThirdOfTheAngle) {
  const Bearings bearings = of_head(10 * kDegree);
  EXPECT_NEAR(rotation_in_view(bearings.first, bearings.second), 10 * kDegree / 3, 10 * kDegree / 6);
}

TEST(RotationInView, ACameraThatTurnsIsNone) {
  Bearings bearings = of_head(0);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (Eigen::Vector3d& b : bearings.second) b = turn * b;
  EXPECT_LT(rotation_in_view(bearings.first, bearings.second), 1e-9);
}

// Each is ten times as far away as the object is wide: static points seemed to rotate.
TEST(RotationInView, AFewWrongMatchesDoNotTurnIt) {
  Bearings bearings = of_head(0);
  for (std::size_t i = 0; i < bearings.second.size(); i += 10) {
    bearings.second[i] = (bearings.second[i] + Eigen::Vector3d(0.5, 0.1, 0)).normalized();
  }
  EXPECT_LT(rotation_in_view(bearings.first, bearings.second), 1e-3);
}

}  // namespace
}  // namespace mono_pose_tracker
