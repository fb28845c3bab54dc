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
// In radians: residuals of a motion that need no polish, a ten thousandth of a pixel in any camera.
constexpr double kExact = 1e-9;
// Sine below which the parallax is all rounding.
constexpr double kLeastParallax = 1e-9;
// In radians: added to the tolerance while a solution is rough.
constexpr double kRoughTolerance = 1e-4;

// Where the camera nearly only turns, every translation nearly fits, and Nister's ten constraints become
// nearly dependent. So the first view is turned until the pairs nearly agree, and E is written as
//   E = [s]x + scale (B - tr(B) I),   B symmetric,   scale = the parallax left,
// in which s and B are of one size, and E is essential if and only if
//   det B = 0,   adj(B) s = 0,   [s]x B [s]x = scale^2 tr(B) adj(B):
// ten cubics in which no digits are lost at any scale. At scale 0 they are the constraints of the
// differential epipolar geometry (Ma, Kosecka and Sastry 2000), at scale 1 with no turn combinations of
// Nister's.

using Lanes = Eigen::Array<double, 4, 1>;  // four polynomials at once
constexpr int kXX = 0, kXY = 1, kYY = 2, kXZ = 3, kYZ = 4, kZZ = 5, kX = 6, kY = 7, kZ = 8, kOne = 9;
constexpr int kQuadraticOf[4][4] = {
    {kXX, kXY, kXZ, kX}, {kXY, kYY, kYZ, kY}, {kXZ, kYZ, kZZ, kZ}, {kX, kY, kZ, kOne}};

/// Coefficients of x, y, z and 1.
struct Linear {
  Lanes c[4];
};

/// Coefficients of xx xy yy xz yz zz x y z 1.
struct Quadratic {
  Lanes c[10];
};

/// The 10x20 matrix of the constraints, columns in Nister's order:
/// xxx yyy xxy xyy xxz xx yyz yy xyz xy | xzz xz x yzz yz y zzz zz z 1
using Constraints = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;

/// Lane i holds entry entries[i] of the solution: x, y, z and 1 times the basis.
Linear linear(const Row10 (&basis)[4], const int (&entries)[4]) {
  Linear result;
  for (int k = 0; k < 4; ++k) {
    result.c[k] << basis[k][entries[0]], basis[k][entries[1]], basis[k][entries[2]], basis[k][entries[3]];
  }
  return result;
}

/// sum += sign a b.
void add_product(double sign, const Linear& a, const Linear& b, Quadratic* sum) {
  for (int k = 0; k < 4; ++k) {
    const Lanes signed_k = sign * a.c[k];
    for (int l = 0; l < 4; ++l) sum->c[kQuadraticOf[k][l]] += signed_k * b.c[l];
  }
}

Quadratic product(const Linear& a, const Linear& b) {
  Quadratic q;
  for (int k = 0; k < 4; ++k) {
    q.c[kQuadraticOf[k][k]] = a.c[k] * b.c[k];
    for (int l = k + 1; l < 4; ++l) q.c[kQuadraticOf[k][l]] = a.c[k] * b.c[l] + a.c[l] * b.c[k];
  }
  return q;
}

Quadratic permuted(const Quadratic& q, const int (&lanes)[4]) {
  Quadratic result;
  for (int k = 0; k < 10; ++k) {
    result.c[k] << q.c[k][lanes[0]], q.c[k][lanes[1]], q.c[k][lanes[2]], q.c[k][lanes[3]];
  }
  return result;
}

/// sum += q l, a cubic in the order of Constraints.
void add_product(const Quadratic& quadratic, const Linear& linear, Lanes (&sum)[20]) {
  const Lanes(&q)[10] = quadratic.c;
  const Lanes(&a)[4] = linear.c;
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

// Entries of a solution: s, and the upper triangle of B.
enum Entry { kS1, kS2, kS3, kB11, kB22, kB33, kB23, kB13, kB12 };

/// det B = 0 and adj(B) s = 0, rows 9 and 0 to 2; the cofactors of the diagonal and of the entries 23, 13 and
/// 12 are left in adjugate and adjugate_off.
void rank_constraints(const Row10 (&basis)[4], Quadratic* adjugate, Quadratic* adjugate_off, Constraints* m) {
  const Linear off = linear(basis, {kB23, kB13, kB12, kB23});
  *adjugate = product(linear(basis, {kB22, kB33, kB11, kB22}), linear(basis, {kB33, kB11, kB22, kB33}));
  add_product(-1, off, off, adjugate);
  *adjugate_off = product(linear(basis, {kB12, kB12, kB13, kB12}), linear(basis, {kB13, kB23, kB23, kB13}));
  add_product(-1, linear(basis, {kB11, kB22, kB33, kB11}), off, adjugate_off);
  Lanes sum[20];
  for (Lanes& s : sum) s.setZero();
  add_product(*adjugate, linear(basis, {kS1, kS2, kS3, kB11}), sum);
  add_product(permuted(*adjugate_off, {2, 0, 1, 2}), linear(basis, {kS2, kS3, kS1, kB12}), sum);
  add_product(permuted(*adjugate_off, {1, 2, 0, 1}), linear(basis, {kS3, kS1, kS2, kB13}), sum);
  for (int c = 0; c < 20; ++c) {
    for (int i = 0; i < 3; ++i) (*m)(i, c) = sum[c][i];
    (*m)(9, c) = sum[c][3];
  }
}

/// [s]x B [s]x = scale^2 tr(B) adj(B), the diagonal in rows 3 to 5, the entries 23, 13 and 12 in rows 6 to 8.
/// -[s]x B [s]x is what the cofactors of B gain by s s^T.
void parallax_constraints(const Row10 (&basis)[4], double scale, const Quadratic& adjugate,
                          const Quadratic& adjugate_off, Constraints* m) {
  const Linear s = linear(basis, {kS1, kS2, kS3, kS1});
  const Quadratic squares = product(s, s);
  const Quadratic products =
      product(linear(basis, {kS2, kS1, kS1, kS2}), linear(basis, {kS3, kS3, kS2, kS3}));
  const Linear off = linear(basis, {kB23, kB13, kB12, kB23});
  Linear minus_two_off, minus_off, minus_diagonal, scaled_trace;
  const Linear diagonal = linear(basis, {kB11, kB22, kB33, kB11});
  for (int k = 0; k < 4; ++k) {
    minus_two_off.c[k] = -2 * off.c[k];
    minus_off.c[k] = -off.c[k];
    minus_diagonal.c[k] = -diagonal.c[k];
    scaled_trace.c[k].setConstant(scale * scale * (basis[k][kB11] + basis[k][kB22] + basis[k][kB33]));
  }
  Lanes sum[20], sum_off[20];
  for (Lanes& cubic : sum) cubic.setZero();
  for (Lanes& cubic : sum_off) cubic.setZero();
  add_product(permuted(squares, {2, 0, 1, 2}), linear(basis, {kB22, kB33, kB11, kB22}), sum);
  add_product(permuted(squares, {1, 2, 0, 1}), linear(basis, {kB33, kB11, kB22, kB33}), sum);
  add_product(products, minus_two_off, sum);
  add_product(adjugate, scaled_trace, sum);
  add_product(permuted(products, {1, 0, 0, 1}), linear(basis, {kB12, kB12, kB13, kB12}), sum_off);
  add_product(permuted(products, {2, 2, 1, 2}), linear(basis, {kB13, kB23, kB23, kB13}), sum_off);
  add_product(products, minus_diagonal, sum_off);
  add_product(squares, minus_off, sum_off);
  add_product(adjugate_off, scaled_trace, sum_off);
  for (int c = 0; c < 20; ++c) {
    for (int i = 0; i < 3; ++i) {
      (*m)(3 + i, c) = sum[c][i];
      (*m)(6 + i, c) = sum_off[c][i];
    }
  }
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

/// Five pairs of unit bearings, the first view's turned so that the pairs nearly agree.
struct AlignedPairs {
  Eigen::Matrix3d turn;
  std::array<Eigen::Vector3d, 5> x1, x2;
  double parallax;  // sine of the angle that the turn leaves between the bearings of a pair, root mean square
};

/// The rotation that takes the frame of two bearings to that of two others.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Matrix3d frame;
  frame.col(0) = (a + b).normalized();
  frame.col(1) = (a - b).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

AlignedPairs align(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2) {
  int furthest = 1;
  for (int i = 2; i < 5; ++i) {
    if (x1[0].dot(x1[i]) < x1[0].dot(x1[furthest])) furthest = i;
  }
  AlignedPairs pairs;
  pairs.turn = frame_of(x2[0], x2[furthest]) * frame_of(x1[0], x1[furthest]).transpose();
  double sum = 0;
  for (int i = 0; i < 5; ++i) {
    pairs.x1[i] = pairs.turn * x1[i];
    pairs.x2[i] = x2[i];
    sum += pairs.x1[i].cross(x2[i]).squaredNorm();
  }
  pairs.parallax = std::max(std::sqrt(sum / 5), kLeastParallax);
  return pairs;
}

/// A basis of the (s, B) with x2^T E x1 = 0 for E = [s]x + parallax (B - tr(B) I), mirrored along `mirror`.
bool basis_of(const AlignedPairs& pairs, const Eigen::Vector4d& mirror, Row10 (&basis)[4]) {
  Row10 conditions[5];
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d &a = pairs.x1[i], &b = pairs.x2[i];
    const double cosine = a.dot(b);
    conditions[i] << a.cross(b) / pairs.parallax, b.x() * a.x() - cosine, b.y() * a.y() - cosine,
        b.z() * a.z() - cosine, b.y() * a.z() + b.z() * a.y(), b.x() * a.z() + b.z() * a.x(),
        b.x() * a.y() + b.y() * a.x(), 0;
    conditions[i].normalize();
  }
  return null_space<5>(conditions, mirror, basis);
}

Eigen::Matrix3d essential_of(const Row10& v, double scale) {
  const double trace = v[kB11] + v[kB22] + v[kB33];
  const double b23 = scale * v[kB23], b13 = scale * v[kB13], b12 = scale * v[kB12];
  Eigen::Matrix3d e;
  e << scale * (v[kB11] - trace), b12 - v[kS3], b13 + v[kS2],  //
      b12 + v[kS3], scale * (v[kB22] - trace), b23 - v[kS1],   //
      b13 - v[kS2], b23 + v[kS1], scale * (v[kB33] - trace);
  return e;
}

/// One of the motions of an essential matrix, its rotation orthogonal only as far as the matrix is essential.
/// Returns how far from it that is; infinity when there is none.
double rough_motion(const Eigen::Matrix3d& essential, Motion* motion) {
  const Eigen::Matrix3d e = essential * std::sqrt(2 / essential.squaredNorm());
  Eigen::Matrix3d cofactor;
  cofactor << e.col(1).cross(e.col(2)), e.col(2).cross(e.col(0)), e.col(0).cross(e.col(1));
  int longest;
  const double length2 = cofactor.colwise().squaredNorm().maxCoeff(&longest);
  if (!(length2 > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d t = cofactor.col(longest) / std::sqrt(length2);
  Eigen::Matrix3d& r = motion->rotation;
  for (int i = 0; i < 3; ++i) r.col(i) = cofactor.col(i) - t.cross(e.col(i));
  motion->translation = t;
  const double lengths2 = r.squaredNorm() - 3;
  return std::abs(lengths2) + std::abs(r.col(0).dot(r.col(1))) + std::abs(r.col(0).dot(r.col(2))) +
         std::abs(r.col(1).dot(r.col(2)));
}

/// Which of the four motions of an essential matrix have the pairs in front of both cameras.
struct Fronts {
  bool as_is = true, reversed = true, twisted = true, twisted_reversed = true;
  bool any() const { return as_is | reversed | twisted | twisted_reversed; }
};

/// `twisted` is turned by half a turn about t, (2 t t^T - I) R; `reversed` has -t. With a = t . R x1, b = t .
/// x2 and c = R x1 . x2 the distances along both rays, times sin^2 of the angle between them, are b c - a and
/// b
/// - a c. Half a turn makes 2 a b - c of c, -t changes both signs. They may fall short by tolerance |t x x2|.
Fronts fronts_of(const Motion& motion, const AlignedPairs& pairs, double tolerance) {
  Fronts fronts;
  for (int i = 0; i < 5 && fronts.any(); ++i) {
    const Eigen::Vector3d turned = motion.rotation * pairs.x1[i];
    const double a = motion.translation.dot(turned), b = motion.translation.dot(pairs.x2[i]);
    const double c = turned.dot(pairs.x2[i]);
    const double slack2 = tolerance * tolerance * (1 - b * b);
    const auto check = [slack2](double first, double second, bool* in_front, bool* behind) {
      const bool first_is_small = first * first < slack2, second_is_small = second * second < slack2;
      *in_front &= ((first > 0) | first_is_small) & ((second > 0) | second_is_small);
      *behind &= ((first < 0) | first_is_small) & ((second < 0) | second_is_small);
    };
    check(b * c - a, b - a * c, &fronts.as_is, &fronts.reversed);
    const double twisted_c = 2 * a * b - c;
    check(b * twisted_c - a, b - a * twisted_c, &fronts.twisted, &fronts.twisted_reversed);
  }
  return fronts;
}

/// Newton's iteration for the orthogonal factor squares the error: once below 1e-8 it is below rounding
/// after.
void orthonormalize(Eigen::Matrix3d* rotation) {
  Eigen::Matrix3d& r = *rotation;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Matrix3d gram = r.transpose() * r;
    r = 1.5 * r - 0.5 * r * gram;
    if ((gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-8) break;
  }
}

/// Newton's method on the five epipolar constraints over rotation and direction of translation, so that E
/// stays an essential matrix. Returns the length of the first step in radians: how far off it found the
/// motion; infinity when it does not converge.
double polish(const AlignedPairs& pairs, Motion* motion) {
  Eigen::Matrix3d& rotation = motion->rotation;
  Eigen::Vector3d& t = motion->translation;
  double first_step2 = 0;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const Eigen::Vector3d u = t.unitOrthogonal(), v = t.cross(u);
    Eigen::Matrix<double, 5, 5> jacobian;
    Eigen::Matrix<double, 5, 1> residual;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d turned1 = rotation * pairs.x1[i];
      const Eigen::Vector3d normal = turned1.cross(pairs.x2[i]);
      residual[i] = normal.dot(t);
      jacobian.row(i) << turned1.cross(pairs.x2[i].cross(t)).transpose(), normal.dot(u), normal.dot(v);
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

Eigen::Matrix3d half_turn_about(const Eigen::Vector3d& t) {
  return 2 * t * t.transpose() - Eigen::Matrix3d::Identity();
}

/// Receives the polished solutions, one motion of each essential matrix.
class EssentialSink {
 public:
  EssentialSink(const AlignedPairs& pairs, std::array<Eigen::Matrix3d, 10>* essentials)
      : pairs_(pairs), essentials_(essentials) {}

  /// Polishes and adds the solution. Returns how far off it was.
  double add_rough(Motion* motion, double) {
    orthonormalize(&motion->rotation);
    const double moved = polish(pairs_, motion);
    if (std::isfinite(moved)) add(*motion);
    return moved;
  }

  int count() const { return count_; }

 private:
  /// Unless it is there already (up to sign): the polished ones agree to 1e-12 where they are one.
  void add(const Motion& motion) {
    Eigen::Matrix3d essential;
    for (int k = 0; k < 3; ++k) {
      essential.col(k) = std::sqrt(0.5) * motion.translation.cross(motion.rotation.col(k));
    }
    essential *= pairs_.turn;
    for (int i = 0; i < count_; ++i) {
      const double cosine = (*essentials_)[i].cwiseProduct(essential).sum();
      if (((*essentials_)[i] - std::copysign(1.0, cosine) * essential).squaredNorm() < 1e-16) return;
    }
    if (count_ < 10) (*essentials_)[count_++] = essential;
  }

  const AlignedPairs& pairs_;
  std::array<Eigen::Matrix3d, 10>* essentials_;
  int count_ = 0;
};

/// Receives the polished motions whose points are in front of both cameras.
class MotionSink {
 public:
  MotionSink(const AlignedPairs& pairs, double tolerance, std::array<Motion, 40>* motions)
      : pairs_(pairs), tolerance_(tolerance), motions_(motions) {}

  /// Polishes the solution where it needs that and adds those of its motions that have the points in front.
  /// Returns how far off it was.
  double add_rough(Motion* motion, double error) {
    const bool is_exact = error < kExact;
    Fronts fronts = fronts_of(*motion, pairs_, is_exact ? tolerance_ : tolerance_ + kRoughTolerance);
    if (!fronts.any()) return error;
    orthonormalize(&motion->rotation);
    if (!is_exact) {
      error = polish(pairs_, motion);
      if (!std::isfinite(error)) return error;
      fronts = fronts_of(*motion, pairs_, tolerance_);
    }
    add(*motion, fronts);
    return error;
  }

  int count() const { return count_; }

 private:
  void add(const Motion& motion, const Fronts& fronts) {
    const Eigen::Vector3d& t = motion.translation;
    const Eigen::Matrix3d rotation = motion.rotation * pairs_.turn;
    if (is_known(rotation, t)) return;
    if (fronts.as_is) put({rotation, t});
    if (fronts.reversed) put({rotation, -t});
    if (!fronts.twisted && !fronts.twisted_reversed) return;
    const Eigen::Matrix3d twisted = half_turn_about(t) * rotation;
    if (fronts.twisted) put({twisted, t});
    if (fronts.twisted_reversed) put({twisted, -t});
  }

  void put(const Motion& motion) {
    if (count_ < 40) (*motions_)[count_++] = motion;
  }

  /// Any of the four motions of one essential matrix is.
  bool is_known(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& t) const {
    for (int i = 0; i < count_; ++i) {
      const Motion& known = (*motions_)[i];
      if (known.translation.cross(t).squaredNorm() > 1e-16) continue;
      if ((known.rotation - rotation).squaredNorm() < 1e-16) return true;
      if ((known.rotation - half_turn_about(t) * rotation).squaredNorm() < 1e-16) return true;
    }
    return false;
  }

  const AlignedPairs& pairs_;
  double tolerance_;
  std::array<Motion, 40>* motions_;
  int count_ = 0;
};

/// Nister's method in the basis of the null space mirrored along `mirror`. Hands the solutions to the sink;
/// false when there is reason to think that some were lost to rounding.
template <class Sink>
bool solve_in_basis(const AlignedPairs& pairs, const Eigen::Vector4d& mirror, Sink* sink) {
  Row10 basis[4];
  if (!basis_of(pairs, mirror, basis)) return true;
  Constraints m;
  Quadratic adjugate, adjugate_off;
  rank_constraints(basis, &adjugate, &adjugate_off, &m);
  parallax_constraints(basis, pairs.parallax, adjugate, adjugate_off, &m);
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
    const double error = rough_motion(essential_of(solution, pairs.parallax), &motion);
    if (!std::isfinite(error)) continue;
    const double moved = sink->add_rough(&motion, error);
    sound = sound && error < kLargestMove && moved < kLargestMove;
  }
  return sound && root_count % 2 == 0;
}

/// Solutions get lost where the elimination pivots badly or roots crowd, and that depends on the basis: what
/// one loses another finds.
template <class Sink>
int solve(const AlignedPairs& pairs, Sink sink) {
  for (const Eigen::Vector4d& mirror : kMirrors) {
    if (solve_in_basis(pairs, mirror, &sink)) break;
  }
  return sink.count();
}

}  // namespace

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials) {
  std::array<Eigen::Vector3d, 5> unit1, unit2;
  for (int i = 0; i < 5; ++i) {
    unit1[i] = x1[i] / x1[i].norm();
    unit2[i] = x2[i] / x2[i].norm();
  }
  const AlignedPairs pairs = align(unit1, unit2);
  return solve(pairs, EssentialSink(pairs, essentials));
}

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               double tolerance, std::array<Motion, 40>* motions) {
  const AlignedPairs pairs = align(x1, x2);
  return solve(pairs, MotionSink(pairs, tolerance, motions));
}

}  // namespace mono_pose_tracker
