#include "tracking/motion_smoothing.h"

#include <gtest/gtest.h>

#include "common/random.h"

namespace mono_pose_tracker {
namespace {

constexpr std::int64_t kPeriod_ns = 100000000;
constexpr double kTremor = 0.002;  // metres

// A walk on a bow at 1 m/s, with a hand's tremor.
Eigen::Vector3d center_at(int i) {
  Random random(100 + static_cast<std::uint64_t>(i));
  return Eigen::Vector3d(5 * std::sin(0.02 * i), 5 * std::cos(0.02 * i), 0) +
         kTremor * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
}

std::vector<UncertainCenter> walk() {
  std::vector<UncertainCenter> centers;
  for (int i = 0; i < 60; ++i) centers.push_back({{i * kPeriod_ns, center_at(i)}});
  return centers;
}

MotionPrior prior_of(const std::vector<UncertainCenter>& centers) {
  return MotionPrior(std::vector<TimedCenter>(centers.begin(), centers.end()));
}

// Says so of itself: off by about sigma along z and by nothing to speak of otherwise.
void loosen(UncertainCenter* center, double sigma, double error) {
  center->is_held = false;
  center->covariance = Eigen::Vector3d(1e-8, 1e-8, sigma * sigma).asDiagonal();
  center->center.z() += error;
}

TEST(MotionSmoothing, WhereImagesTellLittleMotionLeadsBack) {
  std::vector<UncertainCenter> centers = walk();
  for (const int i : {10, 30, 31, 32, 33}) loosen(&centers[i], 1, i % 2 == 0 ? 2 : -1.5);
  smooth_centers(prior_of(walk()), &centers);
  for (int i = 0; i < 60; ++i) {
    if (centers[i].is_held) {
      EXPECT_EQ(centers[i].center, center_at(i));
    } else {
      EXPECT_LT((centers[i].center - center_at(i)).norm(), 0.03) << i;
    }
  }
}

TEST(MotionSmoothing, ASingularCovarianceLeavesTheOthersToBeSmoothed) {
  std::vector<UncertainCenter> centers = walk();
  for (const int i : {10, 31}) loosen(&centers[i], 1, 2);
  centers[40].is_held = false;
  centers[40].covariance.setZero();
  smooth_centers(prior_of(walk()), &centers);
  EXPECT_EQ(centers[40].center, center_at(40));
  for (const int i : {10, 31}) EXPECT_LT((centers[i].center - center_at(i)).norm(), 0.03) << i;
}

TEST(MotionSmoothing, WhereImagesTellTheyAreHeeded) {
  std::vector<UncertainCenter> centers = walk();
  loosen(&centers[20], 1e-4, 0.5);  // a camera that was flung
  smooth_centers(prior_of(walk()), &centers);
  EXPECT_NEAR(centers[20].center.z(), center_at(20).z() + 0.5, 1e-3);
}

TEST(MotionSmoothing, NothingIsTiedWithoutTimeOrPrior) {
  std::vector<UncertainCenter> centers = walk();
  loosen(&centers[20], 1, 2);
  smooth_centers(MotionPrior(), &centers);
  EXPECT_DOUBLE_EQ(centers[20].center.z(), center_at(20).z() + 2);
  for (UncertainCenter& center : centers) center.stamp_ns = 0;
  smooth_centers(prior_of(walk()), &centers);
  EXPECT_NEAR(centers[20].center.z(), center_at(20).z() + 2, 1e-9);
}

}  // namespace
}  // namespace mono_pose_tracker
