#include "tracking/innovation_gate.h"

#include <gtest/gtest.h>

#include "common/statistics.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr std::int64_t kGapNs = 33000000;

// A hand-held camera with steady motion: predicted and estimated poses of each frame.
class InnovationGateTest : public testing::Test {
 protected:
  static RegistrationReport seen_at(const Rigid3& camera_from_map) {
    RegistrationReport report;
    report.success = true;
    report.camera_from_map = camera_from_map;
    report.inliers = 200;
    report.support = {200, {300, 300}, 0.8};
    report.covariance = 1e-8 * Matrix6d::Identity();
    return report;
  }

  static RegistrationReport unexplained_at(const Rigid3& camera_from_map) {
    RegistrationReport report = seen_at(camera_from_map);
    report.inliers = report.support.found = 80;
    return report;
  }

  Rigid3 shaken(const Rigid3& pose, double turn_rad, double shift) {
    Rigid3 off;
    const Eigen::Vector3d w =
        turn_rad * Eigen::Vector3d(random_.normal(), random_.normal(), random_.normal());
    off.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized()));
    off.translation = shift * Eigen::Vector3d(random_.normal(), random_.normal(), random_.normal());
    return off * pose;
  }

  // Number of doubtful frames among this number of further ones.
  int go_on(int frames) {
    int doubted = 0;
    for (int i = 0; i < frames; ++i) {
      const Rigid3 predicted = camera_at({0.01 * i, 0, 0});
      doubted +=
          doubt_.judge(stamp_ += kGapNs, seen_at(shaken(predicted, 0.002, 0.003)), predicted, 15).has_value();
    }
    return doubted;
  }

  Random random_{9};
  InnovationGate doubt_;
  std::int64_t stamp_ = 0;
};

TEST_F(InnovationGateTest, FewOfAQuietMotionAreDoubted) { EXPECT_LE(go_on(3000), 30) << "one in a hundred"; }

TEST_F(InnovationGateTest, AJumpIsDoubtedAndWhatFollowsIsNot) {
  go_on(60);
  const Rigid3 predicted = camera_at({0.6, 0, 0});
  EXPECT_FALSE(doubt_.judge(stamp_ += kGapNs, seen_at(camera_at({0.6, 0.05, 0})), predicted, 15))
      << "a jerk: what the pose shows is seen";
  const auto doubt = doubt_.judge(stamp_ += kGapNs, unexplained_at(camera_at({0.6, 0.05, 0})), predicted, 15);
  ASSERT_TRUE(doubt);
  EXPECT_NE(doubt->find("0.05 units"), std::string::npos) << *doubt;
  EXPECT_LE(go_on(100), 3);
}

TEST_F(InnovationGateTest, CountsThoseInARow) {
  go_on(60);
  for (int i = 1; i <= 3; ++i) {
    const Rigid3 predicted = camera_at({0.6, 0, 0});
    ASSERT_TRUE(doubt_.judge(stamp_ += kGapNs, unexplained_at(camera_at({0.6, 0.05, 0})), predicted, 15))
        << i;
    EXPECT_EQ(doubt_.in_a_row(), i);
  }
  go_on(1);
  EXPECT_EQ(doubt_.in_a_row(), 0);
}

TEST_F(InnovationGateTest, AJumpIsNotLearntAsUsual) {
  go_on(60);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(
        doubt_.judge(stamp_ += kGapNs, unexplained_at(camera_at({0.6, 0.1, 0})), camera_at({0.6, 0, 0}), 15));
  }
}

TEST_F(InnovationGateTest, AfterAGapMoreIsAllowed) {
  go_on(60);
  const RegistrationReport off = unexplained_at(camera_at({0.6, 0.05, 0}));
  EXPECT_FALSE(doubt_.judge(stamp_ + 10 * kGapNs, off, camera_at({0.6, 0, 0}), 15));
}

TEST_F(InnovationGateTest, AfterAGapItIsToldAsFarOffAsItIs) {
  go_on(60);
  const auto doubt =
      doubt_.judge(stamp_ + 3 * kGapNs, unexplained_at(camera_at({0.6, 0.5, 0})), camera_at({0.6, 0, 0}), 15);
  ASSERT_TRUE(doubt);
  EXPECT_NE(doubt->find(" 0.5 units"), std::string::npos) << *doubt;
}

TEST_F(InnovationGateTest, AFewInOneCornerAreDoubtedAtOnce) {
  RegistrationReport corner = seen_at(Rigid3());
  corner.inliers = 20;
  corner.support = {20, {25, 25}, 0.05};
  EXPECT_TRUE(doubt_.judge(stamp_, corner, std::nullopt, 15));
  corner.support.spread = 0.4;
  EXPECT_FALSE(doubt_.judge(stamp_ += kGapNs, corner, std::nullopt, 15));
}

TEST_F(InnovationGateTest, UnitsMayChange) {
  go_on(60);
  doubt_.rescale(100);
  const RegistrationReport off = unexplained_at(camera_at({0.6, 0.3, 0}));
  EXPECT_FALSE(doubt_.judge(stamp_ += kGapNs, off, camera_at({0.6, 0, 0}), 15));
}

}  // namespace
}  // namespace mono_pose_tracker
