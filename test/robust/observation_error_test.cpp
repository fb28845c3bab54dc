#include "robust/observation_error.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

constexpr double kBearingSigma = 1.0 / 500;  // rad

// A point of another map that is seen from elsewhere, and how a step moves that map in this one.
struct Scene {
  explicit Scene(double depth_sigma, Random& random) : other_depth_sigma(depth_sigma) {
    observation.x = 0.3 * random_direction(random);
    observation.center = Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), -4);
    observation.bearing = (observation.x - observation.center + 0.01 * random_direction(random)).normalized();
    observation.depth_sigma = depth_sigma;
    from = Eigen::Vector3d(random.uniform(-3, 3), random.uniform(-3, 3), -3);
    x = observation.x + depth_sigma * random.normal() * (observation.x - from) +
        0.01 * random_direction(random);
  }

  ObservationError error(const SimilarityStep& step) const {
    const Sim3 moved = stepped(Sim3(), step);
    return ObservationError(observation, moved * x, moved * from, other_depth_sigma, kBearingSigma);
  }

  ObservedPoint observation;
  Eigen::Vector3d x, from;
  double other_depth_sigma;
};

TEST(ObservationError, TheGradientIsThatOfHalfTheSquare) {
  Random random(3);
  for (const double depth_sigma : {0.01, 0.1, 0.3}) {
    const Scene scene(depth_sigma, random);
    SimilarityEquations equations;
    scene.error(SimilarityStep::Zero()).add_to(&equations, step_jacobian);
    constexpr double kStep = 1e-6;
    SimilarityStep numeric;
    for (int k = 0; k < kSimilarityParameters; ++k) {
      const SimilarityStep step = kStep * SimilarityStep::Unit(k);
      numeric(k) = (scene.error(step).squared() - scene.error(-step).squared()) / (4 * kStep);
    }
    EXPECT_LT((equations.gradient - numeric).norm(), 1e-5 * numeric.norm()) << depth_sigma;
  }
}

TEST(ObservationError, CountsByTheCovarianceOfBothDepths) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Scene scene(0.05, random);
    const Eigen::Vector3d p = scene.x - scene.observation.center;
    const Eigen::Vector3d error =
        p.normalized() - scene.observation.bearing +
        std::log(p.norm() / (scene.observation.x - scene.observation.center).norm()) *
            scene.observation.bearing;
    const Eigen::Vector3d own = 0.05 * scene.observation.bearing,
                          other = 0.05 / p.norm() * (scene.x - scene.from);
    const Eigen::Matrix3d covariance = kBearingSigma * kBearingSigma * Eigen::Matrix3d::Identity() +
                                       own * own.transpose() + other * other.transpose();
    const double expected = kBearingSigma * kBearingSigma * error.dot(covariance.ldlt().solve(error));
    EXPECT_NEAR(scene.error(SimilarityStep::Zero()).squared(), expected, 1e-9 * expected);
  }
}

// Two nearly parallel observations of a point without depth: an explicit inverse would lose all digits.
TEST(ObservationError, IsNeverBelowZero) {
  ObservedPoint observation;
  observation.x = {0, 0, 2};
  observation.bearing = {0, 0, 1};
  observation.depth_sigma = 1e4;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d x(1e-3 * k, 0, 1 + k), from(1e-7 * k, 0, -100.0 * k - 1);
    const double squared = ObservationError(observation, x, from, 1e4, 1e-4).squared();
    EXPECT_GE(squared, 0);
    EXPECT_LE(squared, (x.normalized() - observation.bearing).squaredNorm() * (1 + 1e-6) + 1e-12);
  }
}

TEST(ObservationError, BehindTheCameraItIsOne) {
  ObservedPoint observation;
  observation.x = {0, 0, 2};
  observation.bearing = {0, 0, 1};
  observation.depth_sigma = 0.1;
  EXPECT_EQ(ObservationError(observation, {0, 0, -1}, {1, 0, 0}, 0.1, 1e-3).squared(), 1);
  EXPECT_EQ(ObservationError(observation, {0, 0, 0}, {1, 0, 0}, 0.1, 1e-3).squared(), 1);
}

}  // namespace
}  // namespace mono_pose_tracker
