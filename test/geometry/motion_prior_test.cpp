#include "geometry/motion_prior.h"

#include <gtest/gtest.h>

#include "common/random.h"

namespace mono_pose_tracker {
namespace {

constexpr double kDensity = 0.5;  // m^2 / s^3

// A camera pushed at random, looked at every so many seconds.
std::vector<TimedCenter> walk(int frames, double period_s, std::uint64_t seed) {
  constexpr int kSteps = 50;
  Random random(seed);
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  const double step_s = period_s / kSteps;
  std::vector<TimedCenter> centers;
  for (int i = 0; i < frames; ++i) {
    centers.push_back({static_cast<std::int64_t>(1e9 * period_s * i), center});
    for (int k = 0; k < kSteps; ++k) {
      center += step_s * velocity;
      velocity +=
          std::sqrt(kDensity * step_s) * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    }
  }
  return centers;
}

double usual_change(const std::vector<TimedCenter>& centers, double period_s) {
  double squares = 0;
  for (std::size_t i = 1; i + 1 < centers.size(); ++i) {
    squares +=
        ((centers[i + 1].center - 2 * centers[i].center + centers[i - 1].center) / period_s).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(3 * (centers.size() - 2)));
}

TEST(MotionPrior, KnowsTheUsualChangeOfVelocityAtAnyRate) {
  for (const double period_s : {0.02, 0.1, 0.5}) {
    const std::vector<TimedCenter> centers = walk(2000, period_s, 1);
    const MotionPrior prior(centers);
    ASSERT_TRUE(prior);
    EXPECT_NEAR(prior.sigma_of_change(period_s, period_s), usual_change(centers, period_s),
                0.05 * usual_change(centers, period_s))
        << period_s;
    // Learnt at one rate, it holds for others.
    EXPECT_NEAR(MotionPrior(walk(2000, 0.1, 2)).sigma_of_change(period_s, period_s),
                prior.sigma_of_change(period_s, period_s), 0.1 * prior.sigma_of_change(period_s, period_s));
  }
}

TEST(MotionPrior, HardlyAnythingThatIsUsualIsBeyondItAndWhatIsFlungIs) {
  std::vector<TimedCenter> centers = walk(2000, 0.1, 3);
  const MotionPrior prior(centers);
  const auto is_beyond = [&](std::size_t i) {
    return prior.is_beyond({centers[i - 1], centers[i], centers[i + 1]}, 0.1);
  };
  for (std::size_t i = 1; i + 1 < centers.size(); ++i) EXPECT_FALSE(is_beyond(i)) << i;
  centers[500].center.z() += 1;
  for (std::size_t i = 499; i <= 501; ++i) EXPECT_TRUE(is_beyond(i)) << i;
  EXPECT_FALSE(is_beyond(497));
  EXPECT_FALSE(prior.is_beyond({centers[499], centers[500], centers[501]}, 2)) << "not by so much";
  EXPECT_FALSE(MotionPrior().is_beyond({centers[499], centers[500], centers[501]}, 0.1));
}

TEST(MotionPrior, AThirdOfOutliersIsNotTakenForMotion) {
  std::vector<TimedCenter> centers = walk(300, 0.1, 4);
  const double usual = MotionPrior(centers).sigma_of_change(0.1, 0.1);
  for (std::size_t i = 100; i < 200; i += 3) centers[i].center.x() += 10;
  EXPECT_LT(MotionPrior(centers).sigma_of_change(0.1, 0.1), 2 * usual);
}

TEST(MotionPrior, AFewCentersOrStampsThatDoNotGrowTellNothing) {
  EXPECT_FALSE(MotionPrior());
  EXPECT_FALSE(MotionPrior(walk(9, 0.1, 5)));
  EXPECT_TRUE(MotionPrior(walk(10, 0.1, 5)));
  std::vector<TimedCenter> still = walk(50, 0.1, 6);
  for (TimedCenter& center : still) center.stamp_ns = 0;
  EXPECT_FALSE(MotionPrior(still));
}

TEST(MotionLoss, IsNothingForWhatIsUsualAndItsSlopeIsItsDerivative) {
  EXPECT_EQ(motion_cost(9), 0);
  EXPECT_EQ(motion_loss_derivative(9), 0);
  for (const double squared : {12.0, 20.0, 44.0, 47.0, 100.0, 1e4}) {
    const double step = 1e-4 * squared;
    EXPECT_NEAR(motion_loss_derivative(squared),
                (motion_cost(squared + step) - motion_cost(squared - step)) / (2 * step), 1e-5);
    if (motion_loss_second_derivative(squared) > 0) {
      EXPECT_NEAR(
          motion_loss_second_derivative(squared),
          (motion_loss_derivative(squared + step) - motion_loss_derivative(squared - step)) / (2 * step),
          1e-5);
    }
  }
  // Rounded squares on either side of the width: a loss that bends where it has no slope is none to Ceres.
  double squared = kMotionLossWidth * kMotionLossWidth;
  for (int i = 0; i < 4; ++i) squared = std::nextafter(squared, 0.0);
  for (int i = 0; i < 8; ++i, squared = std::nextafter(squared, 100.0)) {
    EXPECT_EQ(motion_loss_second_derivative(squared) > 0, motion_loss_derivative(squared) > 0) << i;
  }
  // From far away the pull is that of twice the width.
  EXPECT_NEAR(motion_loss_derivative(1e4) * 100, kMotionLossWidth, 1e-9);
}

}  // namespace
}  // namespace mono_pose_tracker
