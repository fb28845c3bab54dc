#include "mono_pose_tracker/geometry/p3p.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "mono_pose_tracker/geometry/polynomial_roots.h"

namespace mono_pose_tracker {
namespace {

// Sine of the angle below which three points count as collinear, or two bearings as parallel: a
// ten-thousandth of an arc second, where the distances could no longer be told to 1e-6 anyway.
constexpr double kLeastSine = 1e-9;
// Two solutions whose distances agree to this share of their length are one: a double root splits by the
// square root of the rounding, 1e-8.
constexpr double kSame = 1e-7;
// Largest relative residual of the three cosine laws after polishing.
constexpr double kLargestResidual = 1e-9;

/// The triangle of points and its cosine laws s_i^2 + s_j^2 - 2 s_i s_j c_ij = d_ij^2 in the distances s.
struct Triangle {
  double c12, c13, c23;  // cosines of the angles between the bearings
  double d12, d13, d23;  // squared lengths of the sides
};

/// det(l A + B) as a cubic in l.
void pencil_determinant(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, double c[4]) {
  const auto mixed = [](const Eigen::Matrix3d& p, const Eigen::Matrix3d& q) {
    return p.col(0).dot(q.col(1).cross(q.col(2))) + p.col(1).dot(q.col(2).cross(q.col(0))) +
           p.col(2).dot(q.col(0).cross(q.col(1)));
  };
  c[0] = a.determinant();
  c[1] = mixed(b, a);
  c[2] = mixed(a, b);
  c[3] = b.determinant();
}

/// The two real lines of a conic of rank two; false when they are complex. `quality` is largest for the pair
/// that stands out best from rounding.
bool split_conic(const Eigen::Matrix3d& conic, Eigen::Vector3d lines[2], double* quality) {
  const Eigen::Matrix3d m = conic / conic.norm();
  Eigen::Matrix3d adjugate;
  adjugate << m.row(1).cross(m.row(2)), m.row(2).cross(m.row(0)), m.row(0).cross(m.row(1));
  int i = 0;
  adjugate.diagonal().cwiseAbs().maxCoeff(&i);
  *quality = -adjugate(i, i);
  if (!(*quality > 0)) return false;
  // The adjugate of g h^T + h g^T is -(g x h)(g x h)^T; adding [g x h]x leaves one line in each row and
  // column.
  const Eigen::Vector3d p = adjugate.col(i) / std::sqrt(*quality);
  Eigen::Matrix3d one = m;
  one(0, 1) -= p.z();
  one(0, 2) += p.y();
  one(1, 0) += p.z();
  one(1, 2) -= p.x();
  one(2, 0) -= p.y();
  one(2, 1) += p.x();
  int row, column;
  one.cwiseAbs().maxCoeff(&row, &column);
  lines[0] = one.row(row).transpose();
  lines[1] = one.col(column);
  return true;
}

/// Points of the conic on the line, up to scale.
int intersect(const Eigen::Matrix3d& conic, const Eigen::Vector3d& line, Eigen::Vector3d points[2]) {
  int i = 0;
  line.cwiseAbs().maxCoeff(&i);
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();  // two points of the line
  u[j] = 1;
  u[i] = -line[j] / line[i];
  v[k] = 1;
  v[i] = -line[k] / line[i];
  // (u + r v) and (r u + v) on the conic, whichever leads with the larger coefficient.
  double c[3] = {v.dot(conic * v), 2 * u.dot(conic * v), u.dot(conic * u)};
  if (std::abs(c[0]) < std::abs(c[2])) {
    std::swap(c[0], c[2]);
    std::swap(u, v);
  }
  double roots[2];
  if (c[0] == 0) return 0;
  const int count = real_quadratic_roots(c, roots);
  for (int n = 0; n < count; ++n) points[n] = u + roots[n] * v;
  return count;
}

/// Scales the distances and polishes them by Newton's method on the three cosine laws.
bool polish(const Triangle& t, Eigen::Vector3d* distances) {
  Eigen::Vector3d s = *distances;
  if (s.sum() < 0) s = -s;
  const double scale =
      2 * s.squaredNorm() - 2 * (s[0] * s[1] * t.c12 + s[0] * s[2] * t.c13 + s[1] * s[2] * t.c23);
  s *= std::sqrt((t.d12 + t.d13 + t.d23) / scale);
  double error = 0;
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Eigen::Vector3d residual(s[0] * s[0] + s[1] * s[1] - 2 * s[0] * s[1] * t.c12 - t.d12,
                                   s[0] * s[0] + s[2] * s[2] - 2 * s[0] * s[2] * t.c13 - t.d13,
                                   s[1] * s[1] + s[2] * s[2] - 2 * s[1] * s[2] * t.c23 - t.d23);
    error = residual.cwiseAbs().maxCoeff();
    Eigen::Matrix3d jacobian;
    jacobian << s[0] - s[1] * t.c12, s[1] - s[0] * t.c12, 0, s[0] - s[2] * t.c13, 0, s[2] - s[0] * t.c13, 0,
        s[1] - s[2] * t.c23, s[2] - s[1] * t.c23;
    const Eigen::Vector3d step = jacobian.inverse() * (0.5 * residual);
    if (!step.allFinite() || step.norm() > 0.1 * s.norm()) break;
    s -= step;
  }
  *distances = s;
  return s.minCoeff() > 0 && error <= kLargestResidual * s.squaredNorm();
}

/// An orthonormal frame of the triangle, its third axis the normal.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& side12, const Eigen::Vector3d& side13) {
  Eigen::Matrix3d frame;
  frame.col(0) = side12.normalized();
  frame.col(2) = side12.cross(side13).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

bool is_degenerate(const std::array<Eigen::Vector3d, 3>& f, const std::array<Eigen::Vector3d, 3>& x) {
  const Eigen::Vector3d side12 = x[1] - x[0], side13 = x[2] - x[0], side23 = x[2] - x[1];
  const double longest2 = std::max({side12.squaredNorm(), side13.squaredNorm(), side23.squaredNorm()});
  const double sine = std::min({f[0].cross(f[1]).norm(), f[0].cross(f[2]).norm(), f[1].cross(f[2]).norm()});
  return !(side12.cross(side13).norm() > kLeastSine * longest2) || !(sine > kLeastSine) ||
         !std::isfinite(longest2);
}

}  // namespace

int p3p(const std::array<Eigen::Vector3d, 3>& f, const std::array<Eigen::Vector3d, 3>& x,
        std::array<Rigid3, 4>* cameras_from_map) {
  if (is_degenerate(f, x)) return 0;
  const Triangle t = {f[0].dot(f[1]),
                      f[0].dot(f[2]),
                      f[1].dot(f[2]),
                      (x[1] - x[0]).squaredNorm(),
                      (x[2] - x[0]).squaredNorm(),
                      (x[2] - x[1]).squaredNorm()};

  // Two homogeneous conics in the distances: the cosine laws of sides 12 and 23, each against that of
  // side 13.
  Eigen::Matrix3d conic1, conic2;
  conic1 << t.d13 - t.d12, -t.c12 * t.d13, t.c13 * t.d12, -t.c12 * t.d13, t.d13, 0, t.c13 * t.d12, 0, -t.d12;
  conic2 << -t.d23, 0, t.c13 * t.d23, 0, t.d13, -t.c23 * t.d13, t.c13 * t.d23, -t.c23 * t.d13, t.d13 - t.d23;

  // Finsterwalder: the l at which conic1 + l conic2 falls into two lines.
  double cubic[4], roots[3];
  pencil_determinant(conic2, conic1, cubic);
  const int root_count = real_cubic_roots(cubic, roots);
  Eigen::Vector3d lines[2];
  double best_quality = 0;
  for (int i = 0; i < root_count; ++i) {
    Eigen::Vector3d candidate[2];
    double quality;
    if (split_conic(conic1 + roots[i] * conic2, candidate, &quality) && quality > best_quality) {
      best_quality = quality;
      std::copy(candidate, candidate + 2, lines);
    }
  }
  if (best_quality == 0) return 0;

  const Eigen::Matrix3d map_frame = frame_of(x[1] - x[0], x[2] - x[0]);
  Eigen::Vector3d found[4];
  int count = 0;
  for (const Eigen::Vector3d& line : lines) {
    Eigen::Vector3d candidates[2];
    const int candidate_count = intersect(conic1.norm() > conic2.norm() ? conic1 : conic2, line, candidates);
    for (int i = 0; i < candidate_count; ++i) {
      Eigen::Vector3d s = candidates[i];
      if (!polish(t, &s)) continue;
      const auto same = [&s](const Eigen::Vector3d& other) { return (other - s).norm() <= kSame * s.norm(); };
      if (std::any_of(found, found + count, same)) continue;
      const Eigen::Vector3d y[3] = {s[0] * f[0], s[1] * f[1], s[2] * f[2]};
      const Eigen::Matrix3d rotation = frame_of(y[1] - y[0], y[2] - y[0]) * map_frame.transpose();
      (*cameras_from_map)[count] = Rigid3(rotation, y[0] - rotation * x[0]);
      found[count++] = s;
    }
  }
  return count;
}

}  // namespace mono_pose_tracker
