#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "common/rotation.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {

constexpr int kSimilarityParameters = 7;
// turn, shift, relative growth: x' = exp(w) x (1 + g) + v
using SimilarityStep = Eigen::Matrix<double, kSimilarityParameters, 1>;
using PointDerivative = Eigen::Matrix<double, 3, kSimilarityParameters>;  // of a point by a step

// d x' / d step.
inline PointDerivative step_jacobian(const Eigen::Vector3d& x) {
  PointDerivative j;
  j << -cross_matrix(x), Eigen::Matrix3d::Identity(), x;
  return j;
}

inline Sim3 stepped(const Sim3& b_from_a, const SimilarityStep& step) {
  Sim3 change;
  change.rotation = exp_so3(step.head<3>());
  change.translation = step.segment<3>(3);
  change.scale = std::exp(step(6));
  return change * b_from_a;
}

}  // namespace mono_pose_tracker
