#include "mono_pose_tracker/geometry/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mono_pose_tracker/geometry/polynomial_roots.h"
#include "null_space.h"

namespace mono_pose_tracker {
namespace {

// Each mirrors the basis of the null space, whose own axes can miss a solution of a symmetric scene: generic
// vectors.
const Eigen::Vector4d kMirrors[4] = {{0.2887, -0.6471, 0.4563, 0.5384},
                                     {-0.7311, 0.1937, 0.6173, 0.2236},
                                     {0.5124, 0.6308, -0.1729, 0.5561},
                                     {0.1453, 0.4019, 0.7466, -0.5098}};
// Of the smallest pivot against the largest: below it the constraints keep too few of their digits.
constexpr double kLeastPivot = 1e-4;
// In radians: a solution that the polish moves further came from a polynomial whose rounding may hide others.
constexpr double kLargestMove = 1e-6;

using Quadratic = Eigen::Array<double, 10, 1>;  // xx xy yy xz yz zz x y z 1
using Lanes = Eigen::Array<double, 4, 1>;       // three entries of a row of E, and one unused
constexpr int kXX = 0, kXY = 1, kYY = 2, kXZ = 3, kYZ = 4, kZZ = 5, kX = 6, kY = 7, kZ = 8, kOne = 9;
constexpr int kQuadraticOf[4][4] = {
    {kXX, kXY, kXZ, kX}, {kXY, kYY, kYZ, kY}, {kXZ, kYZ, kZZ, kZ}, {kX, kY, kZ, kOne}};

/// The 10x20 matrix of the constraints on E = x X + y Y + z Z + W, columns in Nister's order:
/// xxx yyy xxy xyy xxz xx yyz yy xyz xy | xzz xz x yzz yz y zzz zz z 1
using Constraints = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;

/// The rows of E: three linear polynomials a row (lanes), their coefficients of x, y, z and 1.
struct LinearRows {
  Lanes row[3][4];
};

LinearRows linear_rows(const Row10 (&basis)[4]) {
  LinearRows e;
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < 3; ++i) e.row[i][k] << basis[k][3 * i], basis[k][3 * i + 1], basis[k][3 * i + 2], 0;
  }
  return e;
}

/// Entry (i, j) of E E^T.
Quadratic gram(const LinearRows& e, int i, int j) {
  Quadratic q;
  for (int k = 0; k < 4; ++k) {
    q[kQuadraticOf[k][k]] = (e.row[i][k] * e.row[j][k]).sum();
    for (int l = k + 1; l < 4; ++l) {
      q[kQuadraticOf[k][l]] = (e.row[i][k] * e.row[j][l] + e.row[i][l] * e.row[j][k]).sum();
    }
  }
  return q;
}

/// sum += q (a[0] x + a[1] y + a[2] z + a[3]), for every lane.
void add_product(const Quadratic& q, const Lanes (&a)[4], Lanes (&sum)[20]) {
  sum[0] += q[kXX] * a[0];
  sum[1] += q[kYY] * a[1];
  sum[2] += q[kXX] * a[1] + q[kXY] * a[0];
  sum[3] += q[kXY] * a[1] + q[kYY] * a[0];
  sum[4] += q[kXX] * a[2] + q[kXZ] * a[0];
  sum[5] += q[kXX] * a[3] + q[kX] * a[0];
  sum[6] += q[kYY] * a[2] + q[kYZ] * a[1];
  sum[7] += q[kYY] * a[3] + q[kY] * a[1];
  sum[8] += q[kXY] * a[2] + q[kXZ] * a[1] + q[kYZ] * a[0];
  sum[9] += q[kXY] * a[3] + q[kX] * a[1] + q[kY] * a[0];
  sum[10] += q[kXZ] * a[2] + q[kZZ] * a[0];
  sum[11] += q[kXZ] * a[3] + q[kX] * a[2] + q[kZ] * a[0];
  sum[12] += q[kX] * a[3] + q[kOne] * a[0];
  sum[13] += q[kYZ] * a[2] + q[kZZ] * a[1];
  sum[14] += q[kYZ] * a[3] + q[kY] * a[2] + q[kZ] * a[1];
  sum[15] += q[kY] * a[3] + q[kOne] * a[1];
  sum[16] += q[kZZ] * a[2];
  sum[17] += q[kZZ] * a[3] + q[kZ] * a[2];
  sum[18] += q[kZ] * a[3] + q[kOne] * a[2];
  sum[19] += q[kOne] * a[3];
}

/// E E^T E - 1/2 tr(E E^T) E = 0, nine rows.
void trace_constraints(const LinearRows& e, Constraints* m) {
  Quadratic q[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) q[i][j] = gram(e, i, j);
  }
  const Quadratic half_trace = 0.5 * (q[0][0] + q[1][1] + q[2][2]);
  for (int i = 0; i < 3; ++i) q[i][i] -= half_trace;
  for (int i = 0; i < 3; ++i) {
    Lanes sum[20];
    for (Lanes& s : sum) s.setZero();
    for (int k = 0; k < 3; ++k) add_product(q[std::min(i, k)][std::max(i, k)], e.row[k], sum);
    for (int c = 0; c < 20; ++c) {
      for (int j = 0; j < 3; ++j) (*m)(3 * i + j, c) = sum[c][j];
    }
  }
}

/// det E = 0: the third row times the cross product of the first two.
void determinant_constraint(const LinearRows& e, Constraints* m) {
  Lanes sum[20];
  for (Lanes& s : sum) s.setZero();
  for (int c = 0; c < 3; ++c) {
    const int c1 = (c + 1) % 3, c2 = (c + 2) % 3;
    const auto minor = [&](int k, int l) {
      return e.row[0][k][c1] * e.row[1][l][c2] - e.row[0][k][c2] * e.row[1][l][c1];
    };
    Quadratic q;
    Lanes a[4];
    for (int k = 0; k < 4; ++k) {
      a[k] = Lanes::Constant(e.row[2][k][c]);
      q[kQuadraticOf[k][k]] = minor(k, k);
      for (int l = k + 1; l < 4; ++l) q[kQuadraticOf[k][l]] = minor(k, l) + minor(l, k);
    }
    add_product(q, a, sum);
  }
  for (int c = 0; c < 20; ++c) (*m)(9, c) = sum[c][0];
}

/// Gauss-Jordan elimination with partial pivoting. Of the ten rows only the six led by xxz xx yyz yy xyz xy
/// are needed, so the first four are not cleared of later columns. rows[k] is where the row of leading
/// monomial k ended up. Returns the smallest pivot against the largest.
double eliminate(Constraints* m, int (&rows)[10]) {
  for (int k = 0; k < 10; ++k) rows[k] = k;
  double least = std::numeric_limits<double>::infinity(), largest = 0;
  for (int k = 0; k < 10; ++k) {
    int best = k;
    for (int r = k + 1; r < 10; ++r) {
      if (std::abs((*m)(rows[r], k)) > std::abs((*m)(rows[best], k))) best = r;
    }
    std::swap(rows[k], rows[best]);
    double* pivot_row = &(*m)(rows[k], 0);
    const double pivot = pivot_row[k];
    least = std::min(least, std::abs(pivot));
    largest = std::max(largest, std::abs(pivot));
    const double inverse = 1 / pivot;
    const int first = (k + 1) & ~1;  // even, so that pairs stay aligned
    for (int c = first; c < 20; ++c) pivot_row[c] *= inverse;
    for (int r = k < 4 ? k + 1 : 4; r < 10; ++r) {
      if (r == k) continue;
      double* row = &(*m)(rows[r], 0);
      const double factor = row[k];
      for (int c = first; c < 20; ++c) row[c] -= factor * pivot_row[c];
    }
  }
  return least / largest;
}

/// B(z) of the paper: three rows of a polynomial for x, one for y (degree 3) and one for 1 (degree 4),
/// ascending.
struct ZSystem {
  double x[3][4], y[3][4], one[3][5];
};

ZSystem z_system(const Constraints& m, const int (&rows)[10]) {
  ZSystem b;
  for (int i = 0; i < 3; ++i) {
    const double* e = &m(rows[4 + 2 * i], 10);  // <e>, <g>, <i>
    const double* f = &m(rows[5 + 2 * i], 10);  // <f>, <h>, <j>; <k> = <e> - z <f> and so on
    const double x[4] = {e[2], e[1] - f[2], e[0] - f[1], -f[0]};
    const double y[4] = {e[5], e[4] - f[5], e[3] - f[4], -f[3]};
    const double one[5] = {e[9], e[8] - f[9], e[7] - f[8], e[6] - f[7], -f[6]};
    std::copy(x, x + 4, b.x[i]);
    std::copy(y, y + 4, b.y[i]);
    std::copy(one, one + 5, b.one[i]);
  }
  return b;
}

/// <n> of the paper: det B(z), of degree ten, ascending.
void determinant(const ZSystem& b, double n[11]) {
  std::fill(n, n + 11, 0.0);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    double minor[7] = {};
    for (int p = 0; p < 4; ++p) {
      for (int q = 0; q < 4; ++q) minor[p + q] += b.x[j][p] * b.y[k][q] - b.x[k][p] * b.y[j][q];
    }
    for (int p = 0; p < 7; ++p) {
      for (int q = 0; q < 5; ++q) n[p + q] += minor[p] * b.one[i][q];
    }
  }
}

/// c[0] + c[1] z + ..., or its reverse for a root given as 1/z.
template <int N>
double evaluate(const double (&c)[N], const ProjectiveRoot& root) {
  double value = root.is_inverse ? c[0] : c[N - 1];
  for (int i = 1; i < N; ++i) value = value * root.value + (root.is_inverse ? c[i] : c[N - 1 - i]);
  return value;
}

/// (x, y, z, 1) up to scale from the null vector of B(z): the longest cross product of two of its rows.
Eigen::Vector4d back_substitute(const ZSystem& b, const ProjectiveRoot& root) {
  Eigen::Vector3d row[3];
  for (int i = 0; i < 3; ++i)
    row[i] << evaluate(b.x[i], root), evaluate(b.y[i], root), evaluate(b.one[i], root);
  Eigen::Vector3d best = row[0].cross(row[1]);
  for (int i = 1; i < 3; ++i) {
    const Eigen::Vector3d candidate = row[i].cross(row[(i + 1) % 3]);
    if (candidate.squaredNorm() > best.squaredNorm()) best = candidate;
  }
  // For z = 1/w the null vector is (x w, y w, 1).
  if (root.is_inverse) return {best.x(), best.y(), best.z(), best.z() * root.value};
  return {best.x(), best.y(), best.z() * root.value, best.z()};
}

/// A rotation and the direction of a translation.
struct Motion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d t;
};

/// The closest motion, roughly: exact for an essential matrix.
bool motion_of(const Eigen::Matrix3d& essential, Motion* motion) {
  const Eigen::Matrix3d e = essential * std::sqrt(2 / essential.squaredNorm());
  Eigen::Matrix3d cofactor;
  cofactor << e.col(1).cross(e.col(2)), e.col(2).cross(e.col(0)), e.col(0).cross(e.col(1));
  int longest;
  const double length2 = cofactor.colwise().squaredNorm().maxCoeff(&longest);
  if (!(length2 > 0)) return false;
  const Eigen::Vector3d t = cofactor.col(longest) / std::sqrt(length2);
  Eigen::Matrix3d r;
  for (int i = 0; i < 3; ++i) r.col(i) = cofactor.col(i) - t.cross(e.col(i));
  // Newton's iteration for the orthogonal factor squares the error: once below 1e-8 it is below rounding
  // after.
  for (int i = 0; i < 5; ++i) {
    const Eigen::Matrix3d gram = r.transpose() * r;
    r = 1.5 * r - 0.5 * r * gram;
    if ((gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-8) break;
  }
  motion->rotation = r;
  motion->t = t;
  return true;
}

/// Newton's method on the five epipolar constraints over rotation and direction of translation, so that E
/// stays an essential matrix. Returns the length of the first step in radians: how far off it found the
/// motion; infinity when it does not converge.
double polish(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
              Motion* motion) {
  Eigen::Matrix3d& rotation = motion->rotation;
  Eigen::Vector3d& t = motion->t;
  double first_step2 = 0;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const Eigen::Vector3d u = t.unitOrthogonal(), v = t.cross(u);
    Eigen::Matrix<double, 5, 5> jacobian;
    Eigen::Matrix<double, 5, 1> residual;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d turned1 = rotation * x1[i];
      const Eigen::Vector3d normal = turned1.cross(x2[i]);
      residual[i] = normal.dot(t);
      jacobian.row(i) << turned1.cross(x2[i].cross(t)).transpose(), normal.dot(u), normal.dot(v);
    }
    const Eigen::Matrix<double, 5, 1> step = jacobian.partialPivLu().solve(-residual);
    const double step2 = step.squaredNorm();
    if (iteration == 0) first_step2 = step2;
    // A step of a tenth of a radian is none of a polish.
    if (!(step2 < 0.01)) break;
    const Eigen::Quaterniond turn(1, step[0] / 2, step[1] / 2, step[2] / 2);
    rotation = turn.normalized().toRotationMatrix() * rotation;
    t = (t + step[3] * u + step[4] * v).normalized();
    // Newton's method squares the error: the next step would be below rounding.
    if (step2 < 1e-18) return std::sqrt(first_step2);
  }
  return std::numeric_limits<double>::infinity();
}

/// Adds a solution unless it is there already (up to sign): the polished ones agree to 1e-12 where they are
/// one.
void add_if_new(const Eigen::Matrix3d& essential, std::array<Eigen::Matrix3d, 10>* essentials, int* count) {
  for (int i = 0; i < *count; ++i) {
    const double cosine = (*essentials)[i].cwiseProduct(essential).sum();
    if (((*essentials)[i] - std::copysign(1.0, cosine) * essential).squaredNorm() < 1e-16) return;
  }
  if (*count < 10) (*essentials)[(*count)++] = essential;
}

/// Nister's method in the basis of the null space mirrored along `mirror`. Adds the solutions not there yet;
/// false when there is reason to think that some were lost to rounding.
bool solve_in_basis(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
                    const Eigen::Vector4d& mirror, std::array<Eigen::Matrix3d, 10>* essentials, int* count) {
  Row10 basis[4];
  if (!epipolar_null_space<5>(x1, x2, mirror, basis)) return true;
  const LinearRows e = linear_rows(basis);
  Constraints m;
  trace_constraints(e, &m);
  determinant_constraint(e, &m);
  int rows[10];
  bool sound = eliminate(&m, rows) > kLeastPivot;

  const ZSystem b = z_system(m, rows);
  double n[11];
  determinant(b, n);
  ProjectiveRoot roots[10];
  const int root_count = real_roots_degree10(n, roots);
  for (int i = 0; i < root_count; ++i) {
    const Eigen::Vector4d c = back_substitute(b, roots[i]);
    const Row10 solution = c[0] * basis[0] + c[1] * basis[1] + c[2] * basis[2] + c[3] * basis[3];
    Motion motion;
    if (!motion_of(as_matrix3(solution), &motion)) continue;
    const double moved = polish(x1, x2, &motion);
    sound = sound && moved < kLargestMove;
    if (!std::isfinite(moved)) continue;
    Eigen::Matrix3d essential;
    for (int k = 0; k < 3; ++k) essential.col(k) = std::sqrt(0.5) * motion.t.cross(motion.rotation.col(k));
    add_if_new(essential, essentials, count);
  }
  return sound && *count % 2 == 0;
}

}  // namespace

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials) {
  // Solutions get lost where the elimination pivots badly or roots crowd, and that depends on the basis: what
  // one loses another finds.
  int count = 0;
  for (const Eigen::Vector4d& mirror : kMirrors) {
    if (solve_in_basis(x1, x2, mirror, essentials, &count)) break;
  }
  return count;
}

}  // namespace mono_pose_tracker
