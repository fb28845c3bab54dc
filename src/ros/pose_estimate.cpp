#include "ros/pose_estimate.h"

namespace mono_pose_tracker {

// All to first order in an error (dt, w): t becomes t + dt, R becomes exp(w) R.

PoseEstimate operator*(const Rigid3& c_from_b, const PoseEstimate& b_from_a) {
  const Eigen::Matrix3d R = c_from_b.rotation_matrix();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = R;
  return {c_from_b * b_from_a.b_from_a, J * b_from_a.covariance * J.transpose()};
}

PoseEstimate operator*(const PoseEstimate& b_from_a, const Rigid3& a_from_z) {
  Matrix6d J = Matrix6d::Identity();  // t' = R t_z + t moves by dt + w x (R t_z)
  J.topRightCorner<3, 3>() = -cross_matrix(b_from_a.b_from_a.rotation * a_from_z.translation);
  return {b_from_a.b_from_a * a_from_z, J * b_from_a.covariance * J.transpose()};
}

PoseEstimate inverse(const PoseEstimate& b_from_a) {
  const Eigen::Matrix3d Rt = b_from_a.b_from_a.rotation_matrix().transpose();
  Matrix6d J = Matrix6d::Zero();  // -R^T t moves by -R^T dt - R^T [t]x w, R^T turns by -R^T w
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = -Rt;
  J.topRightCorner<3, 3>() = -Rt * cross_matrix(b_from_a.b_from_a.translation);
  return {b_from_a.b_from_a.inverse(), J * b_from_a.covariance * J.transpose()};
}

}  // namespace mono_pose_tracker
