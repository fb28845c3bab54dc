#include "mono_pose_tracker/geometry/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "mono_pose_tracker/geometry/essential.h"
#include "mono_pose_tracker/geometry/polynomial_roots.h"
#include "null_space.h"

namespace mono_pose_tracker {
namespace {

using Linear = Eigen::Matrix<double, 4, 1>;      // x y z 1
using Quadratic = Eigen::Matrix<double, 10, 1>;  // xx xy yy xz yz zz x y z 1
using Cubic = Eigen::Matrix<double, 20, 1>;      // Nister's order, below
using Null = Eigen::Matrix<double, 9, 4>;

// xxx yyy xxy xyy xxz xx yyz yy xyz xy xzz xz x yzz yz y zzz zz z 1
constexpr int kCubicOf[10][4] = {{0, 2, 4, 5},     {2, 3, 8, 9},     {3, 1, 6, 7},   {4, 8, 10, 11},
                                 {8, 6, 13, 14},   {10, 13, 16, 17}, {5, 9, 11, 12}, {9, 7, 14, 15},
                                 {11, 14, 17, 18}, {12, 15, 18, 19}};
constexpr int kQuadraticOf[4][4] = {{0, 1, 3, 6}, {1, 2, 4, 7}, {3, 4, 5, 8}, {6, 7, 8, 9}};

Quadratic product(const Linear& a, const Linear& b) {
  Quadratic result = Quadratic::Zero();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) result[kQuadraticOf[i][j]] += a[i] * b[j];
  }
  return result;
}

void add_product(const Quadratic& a, const Linear& b, Cubic* sum) {
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 4; ++j) (*sum)[kCubicOf[i][j]] += a[i] * b[j];
  }
}

/// The ten cubic constraints on E = x X + y Y + z Z + W: det E = 0 and E E^T E - 1/2 tr(E E^T) E = 0.
Eigen::Matrix<double, 10, 20> constraints(const Null& basis) {
  const auto e = [&basis](int r, int c) -> Linear { return basis.row(3 * r + c).transpose(); };
  Quadratic eet[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      eet[i][j] = product(e(i, 0), e(j, 0)) + product(e(i, 1), e(j, 1)) + product(e(i, 2), e(j, 2));
      eet[j][i] = eet[i][j];
    }
  }
  const Quadratic half_trace = 0.5 * (eet[0][0] + eet[1][1] + eet[2][2]);
  for (int i = 0; i < 3; ++i) eet[i][i] -= half_trace;

  Eigen::Matrix<double, 10, 20> m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      Cubic row = Cubic::Zero();
      for (int k = 0; k < 3; ++k) add_product(eet[i][k], e(k, j), &row);
      m.row(3 * i + j) = row.transpose();
    }
  }
  Cubic determinant = Cubic::Zero();
  for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    add_product(product(e(1, k1), e(2, k2)) - product(e(1, k2), e(2, k1)), e(0, k), &determinant);
  }
  m.row(9) = determinant.transpose();
  return m;
}

/// B(z) of the paper: three rows (a polynomial for x, one for y: degree 3; one for 1: degree 4), ascending
/// powers.
struct ZSystem {
  double x[3][4], y[3][4], one[3][5];
};

ZSystem z_system(const Eigen::Matrix<double, 6, 10>& rows) {
  ZSystem b;
  for (int i = 0; i < 3; ++i) {
    const auto e = rows.row(2 * i), f = rows.row(2 * i + 1);  // <k> = <e> - z <f>
    const double x[4] = {e[2], e[1] - f[2], e[0] - f[1], -f[0]};
    const double y[4] = {e[5], e[4] - f[5], e[3] - f[4], -f[3]};
    const double one[5] = {e[9], e[8] - f[9], e[7] - f[8], e[6] - f[7], -f[6]};
    std::copy(x, x + 4, b.x[i]);
    std::copy(y, y + 4, b.y[i]);
    std::copy(one, one + 5, b.one[i]);
  }
  return b;
}

template <int N, int M>
void add_product(const double (&a)[N], const double (&b)[M], double sign, double* sum) {
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < M; ++j) sum[i + j] += sign * a[i] * b[j];
  }
}

/// <n> of the paper: det B(z), of degree ten.
void determinant(const ZSystem& b, double n[11]) {
  std::fill(n, n + 11, 0.0);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    double minor[7] = {};
    add_product(b.x[j], b.y[k], 1, minor);
    add_product(b.x[k], b.y[j], -1, minor);
    add_product(minor, b.one[i], 1, n);
  }
}

double evaluate(const double* c, int degree, double z) {
  double value = c[degree];
  for (int i = degree - 1; i >= 0; --i) value = value * z + c[i];
  return value;
}

/// x and y from the null vector of B(z): the longest cross product of two rows.
bool back_substitute(const ZSystem& b, double z, double* x, double* y) {
  Eigen::Vector3d row[3];
  for (int i = 0; i < 3; ++i)
    row[i] << evaluate(b.x[i], 3, z), evaluate(b.y[i], 3, z), evaluate(b.one[i], 4, z);
  Eigen::Vector3d best = row[0].cross(row[1]);
  for (int i = 1; i < 3; ++i) {
    const Eigen::Vector3d candidate = row[i].cross(row[(i + 1) % 3]);
    if (candidate.squaredNorm() > best.squaredNorm()) best = candidate;
  }
  *x = best.x() / best.z();
  *y = best.y() / best.z();
  return std::isfinite(*x) && std::isfinite(*y);
}

/// Newton's method on the five epipolar constraints over rotation and direction of translation, which keeps E
/// an essential matrix. Far from a solution, or where solutions meet, it stops where it got.
bool polish(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
            Eigen::Matrix3d* e) {
  std::array<Rigid3, 4> poses;
  if (!decompose_essential(*e, &poses)) return false;
  Eigen::Matrix3d rotation = poses[0].rotation_matrix();
  Eigen::Vector3d t = poses[0].translation;
  double last_norm = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Eigen::Vector3d u = t.unitOrthogonal(), v = t.cross(u);
    Eigen::Matrix<double, 5, 5> jacobian;
    Eigen::Matrix<double, 5, 1> residual;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d turned1 = rotation * x1[i];
      const Eigen::Vector3d normal = turned1.cross(x2[i]);
      residual[i] = normal.dot(t);
      jacobian.row(i) << turned1.cross(x2[i].cross(t)).transpose(), normal.dot(u), normal.dot(v);
    }
    const double norm = residual.norm();
    if (!(norm < 0.5 * last_norm)) break;
    last_norm = norm;
    const Eigen::Matrix<double, 5, 1> step = jacobian.partialPivLu().solve(-residual);
    // A step of a tenth of a radian is none of a polish.
    if (!step.allFinite() || step.norm() > 0.1) break;
    const Eigen::Quaterniond turn(1, step[0] / 2, step[1] / 2, step[2] / 2);
    rotation = turn.normalized().toRotationMatrix() * rotation;
    t = (t + step[3] * u + step[4] * v).normalized();
  }
  *e = essential_matrix(Rigid3(rotation, t));
  // What is left of an E whose polish failed is no solution: 1e-9 rad is far below any pixel, far above
  // rounding.
  return last_norm < 1e-9;
}

}  // namespace

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials) {
  Null basis;
  if (!epipolar_null_space<5>(x1, x2, &basis)) return 0;

  const Eigen::Matrix<double, 10, 20> m = constraints(basis);
  const Eigen::PartialPivLU<Eigen::Matrix<double, 10, 10>> lu(m.leftCols<10>());
  const Eigen::Matrix<double, 10, 10> reduced = lu.solve(m.rightCols<10>());
  if (!reduced.allFinite()) return 0;

  const ZSystem b = z_system(reduced.bottomRows<6>());
  double n[11], roots[10];
  determinant(b, n);
  const int root_count = real_roots_degree10(n, roots);
  std::array<Eigen::Vector3d, 5> bearings1, bearings2;
  for (int i = 0; i < 5; ++i) {
    bearings1[i] = x1[i].normalized();
    bearings2[i] = x2[i].normalized();
  }
  int count = 0;
  for (int i = 0; i < root_count; ++i) {
    double x, y;
    if (!back_substitute(b, roots[i], &x, &y)) continue;
    const Eigen::Matrix<double, 9, 1> e = basis * Eigen::Vector4d(x, y, roots[i], 1);
    Eigen::Matrix3d essential = as_matrix3(e);
    if (polish(bearings1, bearings2, &essential)) (*essentials)[count++] = essential;
  }
  return count;
}

}  // namespace mono_pose_tracker
