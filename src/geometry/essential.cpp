#include "geometry/essential.h"

#include <Eigen/Geometry>
#include <cmath>

namespace mono_pose_tracker {

Eigen::Matrix3d essential_matrix(const Rigid3& second_from_first) {
  // The Frobenius norm of [t]x R is sqrt(2) |t|.
  const Eigen::Vector3d t = second_from_first.translation.normalized() * std::sqrt(0.5);
  return cross_matrix(t) * second_from_first.rotation_matrix();
}

bool decompose_essential(const Eigen::Matrix3d& essential, std::array<Rigid3, 4>* seconds_from_first) {
  const double norm = essential.norm();
  if (!std::isfinite(norm) || norm == 0) return false;
  const Eigen::Matrix3d e = essential * (std::sqrt(2.0) / norm);

  // t is the left null vector: the longest cross product of two columns is the best conditioned.
  const std::array<Eigen::Vector3d, 3> products = {e.col(0).cross(e.col(1)), e.col(1).cross(e.col(2)),
                                                   e.col(2).cross(e.col(0))};
  Eigen::Vector3d t = products[0];
  for (const Eigen::Vector3d& product : products) {
    if (product.squaredNorm() > t.squaredNorm()) t = product;
  }
  const double length = t.norm();
  if (length == 0) return false;
  t /= length;

  // Of E = [t]x R with |t| = 1: [t]x E = (t t^T - I) R and cofactor(E) = t t^T R, so R = cofactor(E) - [t]x
  // E.
  Eigen::Matrix3d cofactor;
  cofactor << products[1], products[2], products[0];
  const Eigen::Matrix3d turned = cross_matrix(t) * e;
  const Eigen::Quaterniond r1 = Eigen::Quaterniond(Eigen::Matrix3d(cofactor - turned)).normalized();
  const Eigen::Quaterniond r2 = Eigen::Quaterniond(Eigen::Matrix3d(cofactor + turned)).normalized();
  *seconds_from_first = {Rigid3(r1, t), Rigid3(r2, t), Rigid3(r1, -t), Rigid3(r2, -t)};
  return true;
}

double sampson_error(const Eigen::Matrix3d& essential, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2) {
  const Eigen::Vector3d line2 = essential * bearing1;
  const Eigen::Vector3d line1 = essential.transpose() * bearing2;
  const double residual = bearing2.dot(line2);
  // Bearings move on the sphere: only the gradient's part across the bearing counts.
  const double gradient2 = line1.squaredNorm() + line2.squaredNorm() - 2 * residual * residual;
  return gradient2 > 0 ? residual / std::sqrt(gradient2) : 0.0;
}

bool is_in_front(const Rigid3& second_from_first, const Eigen::Vector3d& bearing1,
                 const Eigen::Vector3d& bearing2) {
  // Depths d1, d2 of d1 R b1 + t = d2 b2 in the least squares sense, times |R b1 x b2|^2.
  const Eigen::Vector3d turned1 = second_from_first.rotation * bearing1;
  const double cosine = turned1.dot(bearing2);
  const double along1 = turned1.dot(second_from_first.translation);
  const double along2 = bearing2.dot(second_from_first.translation);
  return cosine * along2 - along1 > 0 && along2 - cosine * along1 > 0;
}

}  // namespace mono_pose_tracker
