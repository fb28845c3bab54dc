#include "mapping/projection_matcher.h"

#include <gtest/gtest.h>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// A camera 4 units from the points' centroid, rotated around them by the angle.
Rigid3 camera_round(double angle) {
  Rigid3 camera_from_map;
  camera_from_map.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
  camera_from_map.translation = Eigen::Vector3d(0, 0, 4);
  return camera_from_map;
}

class ExpectedFindsTest : public testing::Test {
 protected:
  ExpectedFindsTest() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < kPoints; ++i) {
      points.emplace_back(random_.uniform(-0.3, 0.3), random_.uniform(-0.3, 0.3), random_.uniform(-0.3, 0.3));
    }
    scene_ = SyntheticScene(points, random_);
    frame_ = synthetic_frame(scene_, camera_, camera_round(0), 0, 0, random_);
    const Eigen::Vector3d center = camera_round(0).inverse().translation;
    for (int f = 0; f < kPoints; ++f) {
      candidates_.push_back(make_candidate(f, scene_.x_in_map[f], *frame_.image, f, center));
    }
  }

  // Share of the observed landmarks.
  double from(const Rigid3& camera_from_map) const {
    return expected_finds(candidates_, camera_, camera_from_map, {}).expected / kPoints;
  }

  static constexpr int kPoints = 400;
  Random random_{5};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_{{}, random_};
  Frame frame_;
  std::vector<LandmarkCandidate> candidates_;
};

TEST_F(ExpectedFindsTest, AllFromWhereTheyWereSeen) { EXPECT_NEAR(from(camera_round(0)), 1, 1e-6); }

TEST_F(ExpectedFindsTest, FewerAtObliqueViewsAndNoneFromBehind) {
  EXPECT_NEAR(from(camera_round(15 * kDegree)), 0.5, 0.05);
  EXPECT_NEAR(from(camera_round(28 * kDegree)), 0.1, 0.02);
  EXPECT_LT(from(camera_round(45 * kDegree)), 0.005);
  EXPECT_EQ(from(camera_round(90 * kDegree)), 0);
}

TEST_F(ExpectedFindsTest, NoneOutOfViewOrTooSmall) {
  Rigid3 away = camera_round(0);
  away.translation.x() = 10;
  EXPECT_EQ(from(away), 0);
  Rigid3 far = camera_round(0);
  far.translation.z() = 12;  // of features of two pixels two thirds of one are left
  EXPECT_EQ(from(far), 0);
}

}  // namespace
}  // namespace mono_pose_tracker
