#include "mono_pose_tracker/geometry/seven_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "geometry/polynomial_roots.h"
#include "null_space.h"

namespace mono_pose_tracker {
namespace {

// Any vector that favours neither axis of the null space.
const Eigen::Vector2d kMirror(0.31, 0.83);

}  // namespace

int seven_point(const std::array<Eigen::Vector3d, 7>& x1, const std::array<Eigen::Vector3d, 7>& x2,
                std::array<Eigen::Matrix3d, 3>* fundamentals) {
  Row10 basis[2];
  if (!epipolar_null_space<7>(x1, x2, kMirror, basis)) return 0;
  const Eigen::Matrix3d f1 = as_matrix3(basis[0]);
  const Eigen::Matrix3d f2 = as_matrix3(basis[1]);

  // det(a F1 + F2) as a polynomial in a, the middle coefficients by its expansion in rows.
  const auto mixed = [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return a.row(0).dot(b.row(1).cross(b.row(2))) + a.row(1).dot(b.row(2).cross(b.row(0))) +
           a.row(2).dot(b.row(0).cross(b.row(1)));
  };
  const double coefficients[4] = {f1.determinant(), mixed(f2, f1), mixed(f1, f2), f2.determinant()};
  double roots[3];
  const int count = real_cubic_roots(coefficients, roots);
  for (int i = 0; i < count; ++i) (*fundamentals)[i] = (roots[i] * f1 + f2).normalized();
  return count;
}

}  // namespace mono_pose_tracker
