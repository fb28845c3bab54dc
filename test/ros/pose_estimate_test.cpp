#include "ros/messages.h"

#include <gtest/gtest.h>

#include <functional>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

Rigid3 random_pose(Random& random) {
  Eigen::Vector4d q;
  Eigen::Vector3d t;
  for (int i = 0; i < 4; ++i) q[i] = random.normal();
  for (int i = 0; i < 3; ++i) t[i] = 2 * random.normal();
  return {Eigen::Quaterniond(q).normalized(), t};
}

PoseEstimate random_estimate(Random& random) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = random.normal();
  return {random_pose(random), root * root.transpose()};
}

/// x y z and rotations about the fixed axes, as ROS has it.
Rigid3 perturbed(const Rigid3& pose, const Vector6d& error) {
  const Eigen::Vector3d w = error.tail<3>();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(w.norm(), w.normalized()));
  return {turn * pose.rotation, pose.translation + error.head<3>()};
}

Vector6d error_between(const Rigid3& from, const Rigid3& to) {
  const Eigen::AngleAxisd turn((to.rotation * from.rotation.conjugate()).normalized());
  Vector6d error;
  error << to.translation - from.translation, turn.angle() * turn.axis();
  return error;
}

/// Holds the covariance against what the operation does to small errors.
void expect_propagated(const PoseEstimate& in, const std::function<PoseEstimate(const PoseEstimate&)>& f) {
  const double step = 1e-6;
  const PoseEstimate out = f(in);
  Matrix6d J;
  for (int i = 0; i < 6; ++i) {
    const Vector6d error = step * Vector6d::Unit(i);
    J.col(i) = error_between(out.b_from_a, f({perturbed(in.b_from_a, error), in.covariance}).b_from_a) / step;
  }
  const Matrix6d expected = J * in.covariance * J.transpose();
  EXPECT_LT((out.covariance - expected).norm(), 1e-4 * expected.norm());
}

TEST(PoseEstimate, CovarianceFollowsThePose) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const PoseEstimate in = random_estimate(random);
    const Rigid3 other = random_pose(random);
    expect_propagated(in, [&](const PoseEstimate& p) { return other * p; });
    expect_propagated(in, [&](const PoseEstimate& p) { return p * other; });
    expect_propagated(in, [&](const PoseEstimate& p) { return inverse(p); });
  }
}

TEST(PoseEstimate, InverseTwiceIsTheSame) {
  Random random(5);
  const PoseEstimate in = random_estimate(random);
  const PoseEstimate out = inverse(inverse(in));
  EXPECT_LT((out.b_from_a.translation - in.b_from_a.translation).norm(), 1e-12);
  EXPECT_LT((out.covariance - in.covariance).norm(), 1e-9 * in.covariance.norm());
}

}  // namespace
}  // namespace mono_pose_tracker
