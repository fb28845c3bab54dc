#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

constexpr double kPi = 3.14159265358979323846;

/// A degree in radians: 30 * kDegree is 30 degrees, angle / kDegree an angle in degrees.
constexpr double kDegree = kPi / 180;

/// Of two vectors of any length, in radians, [0, pi]; exact also where they are nearly parallel.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// exp([w]x): the turn about w by |w| rad. The identity for a w so short that its direction is lost.
inline Eigen::Quaterniond exp_so3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 1e-300 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                        : Eigen::Quaterniond::Identity();
}

/// The same as a matrix, without the way over a quaternion.
inline Eigen::Matrix3d exp_so3_matrix(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle > 1e-300 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                        : Eigen::Matrix3d::Identity().eval();
}

/// The least turn that takes one direction to the other; of opposite ones any of the half turns. As
/// Eigen::Quaterniond::FromTwoVectors, but without its singular value decomposition for opposite directions,
/// which every file that calls it would have to compile.
inline Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond turn;
  if (cosine > -1 + 1e-12) {
    const double s = std::sqrt((1 + cosine) * 2);
    turn.vec() = a.cross(b) * (1 / s);
    turn.w() = s * 0.5;
  } else {
    turn.vec() = a.unitOrthogonal();
    turn.w() = 0;
  }
  return turn.toRotationMatrix();
}

/// The orthogonal factor of what is nearly a rotation. Newton's iteration squares the error: once below 1e-8
/// it is below rounding after.
inline void orthonormalize(Eigen::Matrix3d* rotation) {
  Eigen::Matrix3d& r = *rotation;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Matrix3d gram = r.transpose() * r;
    r = 1.5 * r - 0.5 * r * gram;
    if ((gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-8) break;
  }
}

/// The adjoint J of SE(3): maps a small motion x' = exp(w) x + v (order v, w) of frame a to the same motion
/// expressed in frame b, which is rigidly attached to a. Covariances transform as C_b = J C_a J^T.
inline Eigen::Matrix<double, 6, 6> adjoint(const Rigid3& b_from_a) {
  const Eigen::Matrix3d R = b_from_a.rotation_matrix();
  Eigen::Matrix<double, 6, 6> J;
  J << R, cross_matrix(b_from_a.translation) * R, Eigen::Matrix3d::Zero(), R;
  return J;
}

}  // namespace mono_pose_tracker
