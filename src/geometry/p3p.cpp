#include "mono_pose_tracker/geometry/p3p.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "geometry/polynomial_roots.h"

namespace mono_pose_tracker {
namespace {

/// What 64 bits can carry. These limits follow from rounding, not from any scene, and are not to be tuned.
struct RoundingLimits {
  // Square of the sine below which three points count as collinear: 1e-9 rad, where the pose could no longer
  // be determined to 1e-6. For bearings the cosines are used, which determine angles to 1.5e-8 rad: 3e-8 rad
  // is the least.
  double sine2_of_points = 1e-18, sine2_of_bearings = 1e-15;
  // Two solutions whose distances agree to this share of their length are one: a double root splits by the
  // square root of the rounding, 1e-8.
  double same = 1e-7;
  // Step of Newton's method, against the triangle's height, that is the last: the laws are quadratic, so that
  // it leaves a residual of twice its square, and a rotation orthonormal to 5e-11. A step whose square is
  // below rounding is the last one anyway.
  double last_step = 5e-6, rounding_step = 1e-8;
  // Residual of the cosine laws, against the squares of the distances, that rounding leaves, and that a
  // solution may have where its Jacobian nearly vanishes.
  double residual = 1e-15, largest_residual = 1e-13;
  // Height of a triangle over its longest side below which its image determines a rotation to fewer than
  // 1e-12.
  double flat = 1e-2;
  // In radians: error that such a solution may have and still be one.
  double largest_angle = 1e-7;
  // Share of the squared coefficient by which rounding and the rough cubic root may move a discriminant.
  // Within it a line that touches the conic (a camera on the danger cylinder) cannot be distinguished from
  // one that passes it.
  double touching = 1e-7;
};
constexpr RoundingLimits kLimits{};

/// The law of cosines in the distances s1, s2, s3 to the three points, for each side, in units of the side
/// 13: s1^2 + s2^2 - 2 c12 s1 s2 = b, s2^2 + s3^2 - 2 c23 s2 s3 = a, s1^2 + s3^2 - 2 c13 s1 s3 = 1.
struct Triangle {
  double a, b;           // at most 1: the side 13 is the longest
  double c12, c13, c23;  // cosines of the angles between the bearings
  double height2;        // over the side 13, squared: errors of the distances tilt a flat triangle the more
};

/// A homogeneous conic in (s1, s2, s3), symmetric.
struct Conic {
  double m[3][3];
};

/// The laws of the sides 12 and 23, each less its multiple of the law of side 13; their pencil l first +
/// second.
Conic first_conic(const Triangle& t) {
  return {{{1 - t.b, -t.c12, t.b * t.c13}, {-t.c12, 1, 0}, {t.b * t.c13, 0, -t.b}}};
}

Conic second_conic(const Triangle& t) {
  return {{{-t.a, 0, t.a * t.c13}, {0, 1, -t.c23}, {t.a * t.c13, -t.c23, 1 - t.a}}};
}

Conic combination(double l, const Conic& first, double k, const Conic& second) {
  Conic d;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) d.m[i][j] = l * first.m[i][j] + k * second.m[i][j];
  }
  return d;
}

/// det(l first + second) = k[0] l^3 + ... + k[3].
void pencil_determinant(const Triangle& t, double k[4]) {
  const double a = t.a, b = t.b, product = 2 * t.c12 * t.c13 * t.c23;
  const double square12 = t.c12 * t.c12, square13 = t.c13 * t.c13, square23 = t.c23 * t.c23;
  k[0] = b * (b * (1 - square13) - (1 - square12));
  k[1] = (1 - b) * (1 - a - b) + a * b - (1 - a) * square12 + b * (product - square13 * (2 * a + b));
  k[2] = (1 - b) * (1 - a - square23) - a * (1 - a - b) + a * (product - square13 * (a + 2 * b));
  k[3] = a * (a * (1 - square13) - (1 - square23));
}

/// The two lines g and h of a conic of rank two. False when they are complex.
[[gnu::always_inline]] inline bool split(const Conic& conic, double g[3], double h[3]) {
  const auto& d = conic.m;
  const double adjugate[3] = {d[1][1] * d[2][2] - d[1][2] * d[1][2], d[2][2] * d[0][0] - d[0][2] * d[0][2],
                              d[0][0] * d[1][1] - d[0][1] * d[0][1]};
  // The lines meet in a point, whose largest coordinate is that of the largest diagonal entry of the
  // adjugate.
  int i = 0;
  if (std::abs(adjugate[1]) > std::abs(adjugate[i])) i = 1;
  if (std::abs(adjugate[2]) > std::abs(adjugate[i])) i = 2;
  if (!(adjugate[i] < 0)) return false;
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  const double inverse = -1 / adjugate[i];
  const double point_j = (d[j][k] * d[i][k] - d[i][j] * d[k][k]) * inverse;  // against coordinate i, negated
  const double point_k = (d[i][j] * d[j][k] - d[i][k] * d[j][j]) * inverse;
  const double q = d[j][k] + std::copysign(std::sqrt(-adjugate[i]), d[j][k]);
  g[j] = d[j][j];
  g[k] = q;
  g[i] = g[j] * point_j + g[k] * point_k;
  h[j] = q;
  h[k] = d[k][k];
  h[i] = h[j] * point_j + h[k] * point_k;
  return true;
}

/// Distances of two candidates.
using Pair = Eigen::Array2d;

/// Points of the conic on a line, up to scale and of one sign. Returns how many; of one, both are that.
[[gnu::always_inline]] inline int intersect(const Conic& conic, const double line[3], Pair points[3]) {
  const auto& d = conic.m;
  int i = 0;
  if (std::abs(line[1]) > std::abs(line[i])) i = 1;
  if (std::abs(line[2]) > std::abs(line[i])) i = 2;
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  const double inverse = -1 / line[i];
  const double m = line[j] * inverse, n = line[k] * inverse;  // s_i = m s_j + n s_k
  const double p = d[i][i] * m + d[i][j], r = d[i][i] * n + d[i][k];
  const double jj = d[j][j] + m * (p + d[i][j]);
  const double jk = d[j][k] + n * p + m * d[i][k];
  const double kk = d[k][k] + n * (r + d[i][k]);
  double discriminant = jk * jk - jj * kk;
  if (discriminant < 0 && discriminant > -kLimits.touching * jk * jk) discriminant = -discriminant;
  if (!(discriminant >= 0)) return 0;
  const double q = -jk - std::copysign(std::sqrt(discriminant), jk);
  Pair s_j(q, kk), s_k(jj, q);
  Pair s_i = m * s_j + n * s_k;
  const Pair jk_sign = s_j * s_k, ik_sign = s_i * s_k;
  const bool first = jk_sign[0] > 0 && ik_sign[0] > 0, second = jk_sign[1] > 0 && ik_sign[1] > 0;
  if (!(first && second)) {
    if (!first && !second) return 0;
    s_i = Pair::Constant(first ? s_i[0] : s_i[1]);
    s_j = Pair::Constant(first ? s_j[0] : s_j[1]);
    s_k = Pair::Constant(first ? s_k[0] : s_k[1]);
  }
  points[i] = s_i.abs();
  points[j] = s_j.abs();
  points[k] = s_k.abs();
  return first && second ? 2 : 1;
}

/// The laws at some distances, halved, and Newton's step from there, to be subtracted. T: of one candidate,
/// or of a pair.
template <class T>
struct Linearized {
  T r12, r13, r23;
  T step[3];
};

template <class T>
[[gnu::always_inline]] inline Linearized<T> linearized(const Triangle& t, const T s[3]) {
  const T u12 = s[0] - t.c12 * s[1], u21 = s[1] - t.c12 * s[0];  // half the derivatives
  const T u13 = s[0] - t.c13 * s[2], u31 = s[2] - t.c13 * s[0];
  const T u23 = s[1] - t.c23 * s[2], u32 = s[2] - t.c23 * s[1];
  Linearized<T> at;
  at.r12 = 0.5 * (s[0] * u12 + s[1] * u21 - t.b);
  at.r13 = 0.5 * (s[0] * u13 + s[2] * u31 - 1);
  at.r23 = 0.5 * (s[1] * u23 + s[2] * u32 - t.a);
  const T inverse = 1 / (u12 * u31 * u23 + u21 * u13 * u32);
  at.step[0] = inverse * (at.r12 * u23 * u31 + u21 * (at.r13 * u32 - at.r23 * u31));
  at.step[1] = inverse * (u12 * (u31 * at.r23 - u32 * at.r13) + at.r12 * u13 * u32);
  at.step[2] = inverse * (u12 * u23 * at.r13 + u13 * (u21 * at.r23 - u23 * at.r12));
  return at;
}

/// Newton's method with the best length of each step, for where the Jacobian nearly vanishes: near a double
/// solution a step of Newton's goes half of the way, and at one anywhere. False when no solution is near.
[[gnu::noinline]] bool descend(const Triangle& t, double s[3]) {
  double error2 = 0, unit = 0;
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Linearized<double> at = linearized(t, s);
    error2 = at.r12 * at.r12 + at.r13 * at.r13 + at.r23 * at.r23;
    unit = 1 + s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
    if (error2 <= kLimits.residual * unit * kLimits.residual * unit) return true;
    // A share l of the step leaves (1 - l) r + l^2 q, with the quadratic forms q of the whole step.
    const double* d = at.step;
    const double q12 = 0.5 * (d[0] * d[0] + d[1] * d[1]) - t.c12 * d[0] * d[1];
    const double q13 = 0.5 * (d[0] * d[0] + d[2] * d[2]) - t.c13 * d[0] * d[2];
    const double q23 = 0.5 * (d[1] * d[1] + d[2] * d[2]) - t.c23 * d[1] * d[2];
    const double ratio = (q12 * at.r12 + q13 * at.r13 + q23 * at.r23) / error2;
    if (!std::isfinite(ratio)) break;
    // The smaller root of 1 - l + ratio l^2, or where that is least.
    const double share = ratio > 0.25 ? 0.5 / ratio : 2 / (1 + std::sqrt(1 - 4 * ratio));
    for (int i = 0; i < 3; ++i) s[i] -= share * d[i];
  }
  return error2 <= kLimits.largest_residual * unit * kLimits.largest_residual * unit;
}

/// From where Newton's method began and from where it ended, until one succeeds; writes the solution to
/// `end`. Near a double solution it may have left for another one; of a flat triangle the start may be too
/// far.
bool descend_from_either(const Triangle& t, const double start[3], double end[3]) {
  double other[3];
  std::copy(start, start + 3, other);
  if (!(t.height2 > kLimits.flat * kLimits.flat)) std::swap_ranges(other, other + 3, end);
  if (!descend(t, other)) return descend(t, end);
  std::copy(other, other + 3, end);
  return true;
}

/// Scales two candidates to the triangle, writes these as `start`, and polishes them by Newton's method on
/// the three cosine laws until both steps are short. Returns the squares of the last steps.
[[gnu::always_inline]] inline Pair polish(const Triangle& t, double last_step2, Pair s[3], Pair start[3]) {
  const Pair sum =
      2 * (s[0] * (s[0] - t.c12 * s[1]) + s[1] * (s[1] - t.c23 * s[2]) + s[2] * (s[2] - t.c13 * s[0]));
  const Pair scale = ((1 + t.a + t.b) / sum).sqrt();
  for (int i = 0; i < 3; ++i) start[i] = s[i] = s[i] * scale;
  Pair step2;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const Linearized<Pair> at = linearized(t, s);
    const Pair* d = at.step;
    for (int i = 0; i < 3; ++i) s[i] -= d[i];
    step2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (step2[0] <= last_step2 && step2[1] <= last_step2) break;
  }
  return step2;
}

/// Cube root of x > 0 to a few parts in 1e5: a third of the exponent, then Halley's method once.
double rough_cube_root(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof(bits));
  bits = bits / 3 + 0x2a9f7893782da1ceull;
  double y;
  std::memcpy(&y, &bits, sizeof(y));
  const double cube = y * y * y;
  return y * (cube + 2 * x) / (2 * cube + x);
}

/// The best separated real root of k[0] l^3 + ... + k[3], k[0] != 0: a start from the cubic's closed form,
/// then Newton.
double separated_cubic_root(const double k[4]) {
  const double inverse = 1 / k[0];
  const double a = k[1] * inverse, b = k[2] * inverse, d = k[3] * inverse;
  const double third = a * (1.0 / 3);
  // x^3 - 3 q x + 2 r = 0 with x = l + a / 3.
  const double q = third * third - b * (1.0 / 3);
  const double r = third * third * third - 0.5 * (third * b - d);
  const double q3 = q * q * q;
  double x;
  if (r * r < q3) {
    // cos(acos(w) / 3) for w in [0, 1], to 1e-4.
    const double length = std::sqrt(q), w = std::abs(r) / (length * q);
    x = 2 * length * (0.8660254 + w * (0.1666667 + w * (-0.0425206 + w * 0.0098286)));
  } else {
    const double s = rough_cube_root(std::abs(r) + std::sqrt(r * r - q3));
    x = s + q / s;
  }
  const double root = -std::copysign(x, r) - third;
  const double value = ((root + a) * root + b) * root + d;
  const double slope = (3 * root + 2 * a) * root + b;
  return root - value / slope;
}

/// The member of the pencil that falls into two lines g and h. Returns the conic to meet them with, or
/// nullptr.
const Conic* split_pencil(const Triangle& t, const Conic& first, const Conic& second, double g[3],
                          double h[3]) {
  double k[4];
  pencil_determinant(t, k);
  // The closed form divides by k[0]. Where that nearly vanishes, so that `first` itself is nearly degenerate,
  // every root gets its trial.
  if (std::abs(k[0]) > 1e-4 * (std::abs(k[1]) + std::abs(k[2]) + std::abs(k[3]))) {
    const double l = separated_cubic_root(k);
    if (std::isfinite(l)) {
      return split(combination(l, first, 1, second), g, h) ? (std::abs(l) > 1 ? &second : &first) : nullptr;
    }
  }
  std::swap(k[0], k[3]);
  std::swap(k[1], k[2]);
  double roots[3];
  const int count = real_cubic_roots(k, roots);
  for (int i = 0; i < count; ++i) {
    if (split(combination(1, first, roots[i], second), g, h))
      return std::abs(roots[i]) > 1 ? &first : &second;
  }
  return nullptr;
}

/// Whether a point in the camera's frame is seen along the bearing within largest_angle.
bool projects(const Eigen::Vector3d& y, const Eigen::Vector3d& bearing) {
  return y.cross(bearing).squaredNorm() <= kLimits.largest_angle * kLimits.largest_angle * y.squaredNorm() &&
         y.dot(bearing) > 0;
}

}  // namespace

int p3p(const std::array<Eigen::Vector3d, 3>& bearings_in_camera,
        const std::array<Eigen::Vector3d, 3>& points_in_map, std::array<Motion, 4>* cameras_from_map) {
  // Order the points so that the side 13 is the longest.
  const auto& points = points_in_map;
  const double side01 = (points[1] - points[0]).squaredNorm(), side02 = (points[2] - points[0]).squaredNorm(),
               side12 = (points[2] - points[1]).squaredNorm();
  const int middle = side02 >= side01 && side02 >= side12 ? 1 : (side01 >= side12 ? 2 : 0);
  const int first = middle == 0 ? 1 : 0, last = middle == 2 ? 1 : 2;
  const Eigen::Vector3d &f1 = bearings_in_camera[first], &f2 = bearings_in_camera[middle],
                        &f3 = bearings_in_camera[last];
  const Eigen::Vector3d x12 = points[middle] - points[first], x13 = points[last] - points[first];
  const double d13 = x13.squaredNorm(), inverse_d13 = 1 / d13;
  // The height over the side 13, at a right angle to it also where the triangle is flat.
  const double along = x12.dot(x13) * inverse_d13;
  Eigen::Vector3d x_height = x12 - along * x13;
  x_height -= (x_height.dot(x13) * inverse_d13) * x13;
  const Eigen::Vector3d normal = x_height.cross(x13);
  const double normal2 = normal.squaredNorm();
  if (!(normal2 > kLimits.sine2_of_points * d13 * d13) || !std::isfinite(normal2)) return 0;
  const Triangle t = {(points[last] - points[middle]).squaredNorm() * inverse_d13,
                      x12.squaredNorm() * inverse_d13,
                      f1.dot(f2),
                      f1.dot(f3),
                      f2.dot(f3),
                      normal2 * inverse_d13 * inverse_d13};
  const double largest_cosine = std::max({std::abs(t.c12), std::abs(t.c13), std::abs(t.c23)});
  if (!(1 - largest_cosine * largest_cosine > kLimits.sine2_of_bearings)) return 0;

  const Conic conic1 = first_conic(t), conic2 = second_conic(t);
  double lines[2][3];
  const Conic* conic = split_pencil(t, conic1, conic2, lines[0], lines[1]);
  if (!conic) return 0;

  // R maps the triangle's longest side, its height over that side, and its normal: their images times the
  // inverse of the three.
  const double inverse_normal2 = 1 / normal2, unit = std::sqrt(d13);
  const double height = std::sqrt(normal2 * inverse_d13);
  const Eigen::Vector3d by13 = x13 * inverse_d13, by_height = x_height * (d13 * inverse_normal2),
                        by_normal = normal * inverse_normal2;
  const double last_step2 = std::max(kLimits.last_step * kLimits.last_step * t.height2,
                                     kLimits.rounding_step * kLimits.rounding_step);
  double found[4][3];
  int count = 0;
  for (const auto& line : lines) {
    Pair polished[3], start[3];
    const int candidates = intersect(*conic, line, polished);
    if (candidates == 0) continue;
    const Pair step2 = polish(t, last_step2, polished, start);
    for (int i = 0; i < candidates; ++i) {
      double s[3] = {polished[0][i], polished[1][i], polished[2][i]};
      const bool converged = step2[i] <= last_step2;
      if (!converged) {
        const double from[3] = {start[0][i], start[1][i], start[2][i]};
        if (!descend_from_either(t, from, s)) continue;
      }
      if (!(s[0] > 0 && s[1] > 0 && s[2] > 0)) continue;
      const bool is_exact = converged && t.height2 > kLimits.flat * kLimits.flat;
      const auto same = [&s](const double* other) {
        return std::abs(s[0] - other[0]) + std::abs(s[1] - other[1]) + std::abs(s[2] - other[2]) <=
               kLimits.same * (s[0] + s[1] + s[2]);
      };
      if (std::any_of(found, found + count, same)) continue;
      const Eigen::Vector3d y1 = unit * s[0] * f1, y12 = unit * s[1] * f2 - y1;
      Eigen::Vector3d y13 = unit * s[2] * f3 - y1;
      Motion& pose = (*cameras_from_map)[count];
      Eigen::Vector3d y_height = y12 - along * y13;
      if (!is_exact) {
        // The laws' residuals tilt a flat triangle: its side and height as they are, at a right angle.
        if (!converged) y13 *= unit / y13.norm();
        y_height -= (y_height.dot(y13) * inverse_d13) * y13;
        y_height *= height / y_height.norm();
        if (!projects(y1 + along * y13 + y_height, f2)) continue;
      }
      const Eigen::Vector3d y_normal = y_height.cross(y13);
      for (int k = 0; k < 3; ++k) {
        pose.rotation.col(k) = by13[k] * y13 + by_height[k] * y_height + by_normal[k] * y_normal;
      }
      pose.translation = y1 - pose.rotation * points[first];
      std::copy(s, s + 3, found[count++]);
    }
  }
  return count;
}

}  // namespace mono_pose_tracker
