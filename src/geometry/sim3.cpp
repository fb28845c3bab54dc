#include "mono_pose_tracker/geometry/sim3.h"

#include <cmath>

namespace mono_pose_tracker {
namespace {

using Points = Eigen::Matrix<double, 3, Eigen::Dynamic>;

Points as_matrix(const std::vector<Eigen::Vector3d>& points) {
  return Eigen::Map<const Points>(points.front().data(), 3, static_cast<Eigen::Index>(points.size()));
}

template <typename Matrix>
bool coincide(const Matrix& points) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  // Rounding alone spreads n equal points by some 1e-16 of their distance from the origin.
  return (points.colwise() - mean).norm() <= 1e-12 * points.norm();
}

template <typename Matrix>
bool align(const Matrix& a, const Matrix& b, bool with_scale, Sim3* b_from_a) {
  if (!a.allFinite() || !b.allFinite() || coincide(a) || coincide(b)) return false;
  const Eigen::Matrix4d transform = Eigen::umeyama(a, b, with_scale);
  if (!transform.allFinite()) return false;
  const Eigen::Matrix3d scaled = transform.topLeftCorner<3, 3>();
  const double scale = std::cbrt(scaled.determinant());
  if (!(scale > 0)) return false;
  b_from_a->scale = scale;
  b_from_a->rotation = Eigen::Quaterniond(Eigen::Matrix3d(scaled / scale)).normalized();
  b_from_a->translation = transform.topRightCorner<3, 1>();
  return true;
}

}  // namespace

bool align_sim3(const std::vector<Eigen::Vector3d>& points_in_a,
                const std::vector<Eigen::Vector3d>& points_in_b, Sim3* b_from_a) {
  if (points_in_a.size() < 3 || points_in_a.size() != points_in_b.size()) return false;
  return align(as_matrix(points_in_a), as_matrix(points_in_b), true, b_from_a);
}

bool align_sim3(const Eigen::Matrix3d& points_in_a, const Eigen::Matrix3d& points_in_b, Sim3* b_from_a) {
  return align(points_in_a, points_in_b, true, b_from_a);
}

bool align_se3(const std::vector<Eigen::Vector3d>& points_in_a,
               const std::vector<Eigen::Vector3d>& points_in_b, Sim3* b_from_a) {
  if (points_in_a.size() < 3 || points_in_a.size() != points_in_b.size()) return false;
  if (!align(as_matrix(points_in_a), as_matrix(points_in_b), false, b_from_a)) return false;
  b_from_a->scale = 1;  // but for rounding
  return true;
}

}  // namespace mono_pose_tracker
