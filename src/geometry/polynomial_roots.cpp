#include "geometry/polynomial_roots.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace mono_pose_tracker {
namespace {

// A leading coefficient this small against the others puts a root beyond 1e14: at infinity for our purposes.
constexpr double kVanishing = 1e-14;

double polished_cubic_root(const double c[4], double x) {
  for (int i = 0; i < 2; ++i) {
    const double value = ((c[0] * x + c[1]) * x + c[2]) * x + c[3];
    const double slope = (3 * c[0] * x + 2 * c[1]) * x + c[2];
    if (slope == 0) break;
    const double next = x - value / slope;
    const double next_value = ((c[0] * next + c[1]) * next + c[2]) * next + c[3];
    if (!(std::abs(next_value) < std::abs(value))) break;
    x = next;
  }
  return x;
}

constexpr int kDegree = 10;
// Halvings of [0, 1] before roots that crowd an interval are taken for a double root: 1e-6, where rounding
// makes the difference between two real roots and a complex pair.
constexpr int kDeepest = 20;

/// Bernstein coefficients of a polynomial on an interval.
struct Piece {
  double b[kDegree + 1];
  double start, width;
  int depth;
};

/// sum c[i] z^i on [0, 1].
Piece bernstein(const double c[kDegree + 1]) {
  constexpr double kBinomial[kDegree + 1] = {1, 10, 45, 120, 210, 252, 210, 120, 45, 10, 1};
  Piece piece;
  for (int i = 0; i <= kDegree; ++i) piece.b[i] = c[i] / kBinomial[i];
#pragma GCC unroll 10
  for (int level = 0; level < kDegree; ++level) {
#pragma GCC unroll 10
    for (int i = kDegree; i > level; --i) piece.b[i] += piece.b[i - 1];
  }
  piece.start = 0;
  piece.width = 1;
  piece.depth = 0;
  return piece;
}

/// De Casteljau's algorithm: `piece` becomes its own left half, `right` the right one.
void halve(Piece* piece, Piece* right) {
  double b[kDegree + 1];
  std::copy(piece->b, piece->b + kDegree + 1, b);
  double scale = 1;
  right->b[kDegree] = b[kDegree];
#pragma GCC unroll 10
  for (int level = 1; level <= kDegree; ++level) {
#pragma GCC unroll 10
    for (int i = kDegree; i >= level; --i) b[i] += b[i - 1];
    scale *= 0.5;
    piece->b[level] = scale * b[level];
    right->b[kDegree - level] = scale * b[kDegree];
  }
  piece->width *= 0.5;
  piece->depth += 1;
  right->start = piece->start + piece->width;
  right->width = piece->width;
  right->depth = piece->depth;
}

int sign_changes(const double b[kDegree + 1]) {
  std::uint64_t bits[kDegree + 1];
  std::memcpy(bits, b, sizeof(bits));
  std::uint64_t changes = 0;
  for (int i = 0; i < kDegree; ++i) changes += (bits[i] ^ bits[i + 1]) >> 63;
  return static_cast<int>(changes);
}

/// Where the control polygon with one change of sign crosses zero, in [0, 1].
double crossing(const double b[kDegree + 1]) {
  int i = 0;
  while (i < kDegree - 1 && std::signbit(b[i]) == std::signbit(b[i + 1])) ++i;
  return (i + b[i] / (b[i] - b[i + 1])) / kDegree;
}

/// Value and derivative of sum c[i] z^i by Horner's rule in z^2, for even and odd powers in parallel: half
/// the latency of Horner's rule in z.
inline void evaluate(const double c[kDegree + 1], double z, double* value, double* slope) {
  const double w = z * z;
  double even = c[10], odd = c[9], even_slope = c[10], odd_slope = c[9];
  even = even * w + c[8];
  odd = odd * w + c[7];
  for (int i = 6; i >= 2; i -= 2) {
    even_slope = even_slope * w + even;
    odd_slope = odd_slope * w + odd;
    even = even * w + c[i];
    odd = odd * w + c[i - 1];
  }
  even_slope = even_slope * w + even;
  even = even * w + c[0];
  *value = even + z * odd;
  *slope = odd + 2 * z * (even_slope + z * odd_slope);
}

/// Newton's method from z, kept within the bracket [low, high] of one change of sign.
double refined(const double c[kDegree + 1], double low, double high, bool low_is_negative, double z) {
  for (int iteration = 0; iteration < 40; ++iteration) {
    double value, slope;
    evaluate(c, z, &value, &slope);
    ((value < 0) == low_is_negative ? low : high) = z;
    double next = z - value / slope;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double step = std::abs(next - z);
    z = next;
    // Newton's method squares the error.
    if (step < 1e-6) break;
  }
  return z;
}

/// Roots of sum c[i] z^i in [0, 1].
int roots_in_unit_interval(const double c[kDegree + 1], double roots[kDegree]) {
  Piece stack[kDeepest + 2];
  stack[0] = bernstein(c);
  int size = 1, count = 0;
  while (size > 0 && count < kDegree - 1) {
    Piece& piece = stack[size - 1];
    const int changes = sign_changes(piece.b);
    if (changes == 0) {
      --size;
    } else if (changes == 1) {
      roots[count++] = refined(c, piece.start, piece.start + piece.width, std::signbit(piece.b[0]),
                               piece.start + piece.width * crossing(piece.b));
      --size;
    } else if (piece.depth == kDeepest) {
      roots[count++] = piece.start;
      roots[count++] = piece.start + piece.width;
      --size;
    } else {
      halve(&piece, &stack[size]);
      ++size;
    }
  }
  return count;
}

}  // namespace

int real_quadratic_roots(const double c[3], double roots[2]) {
  const double half = 0.5 * c[1];
  const double discriminant = half * half - c[0] * c[2];
  if (!(discriminant >= 0)) return 0;
  const double q = -(half + std::copysign(std::sqrt(discriminant), half));
  if (q == 0) {
    roots[0] = roots[1] = 0;
    return 2;
  }
  roots[0] = q / c[0];
  roots[1] = c[2] / q;
  if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
  return 2;
}

int real_cubic_roots(const double c[4], double roots[3]) {
  const double sum = std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3]);
  if (!std::isfinite(sum) || sum == 0) return 0;
  if (std::abs(c[0]) <= kVanishing * sum) {
    if (std::abs(c[1]) > kVanishing * sum) return real_quadratic_roots(c + 1, roots);
    if (std::abs(c[2]) <= kVanishing * sum) return 0;
    roots[0] = -c[3] / c[2];
    return 1;
  }
  // Viete's and Cardano's formulas for x^3 + a x^2 + b x + d.
  const double a = c[1] / c[0], b = c[2] / c[0], d = c[3] / c[0];
  const double q = (a * a - 3 * b) / 9;
  const double r = (a * (2 * a * a - 9 * b) + 27 * d) / 54;
  int count = 0;
  if (r * r < q * q * q) {
    const double angle = std::acos(std::clamp(r / std::sqrt(q * q * q), -1.0, 1.0)) / 3;
    const double third_of_turn = 2.0943951023931953;
    for (int k = -1; k <= 1; ++k) {
      roots[count++] = -2 * std::sqrt(q) * std::cos(angle + k * third_of_turn) - a / 3;
    }
  } else {
    const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(r * r - q * q * q)), r);
    roots[count++] = s + (s == 0 ? 0 : q / s) - a / 3;
  }
  for (int i = 0; i < count; ++i) roots[i] = polished_cubic_root(c, roots[i]);
  return count;
}

int real_roots_degree10(const double c[11], ProjectiveRoot roots[10]) {
  double sum = 0;
  for (int i = 0; i <= kDegree; ++i) sum += std::abs(c[i]);
  if (!(sum > 0) || !std::isfinite(sum)) return 0;

  // The real line in four: z in [0, 1] and [-1, 0], 1/z in [0, 1] and [-1, 0].
  int count = 0;
  for (const bool is_inverse : {false, true}) {
    double ascending[kDegree + 1];
    for (int i = 0; i <= kDegree; ++i) ascending[i] = is_inverse ? c[kDegree - i] : c[i];
    for (const double sign : {1.0, -1.0}) {
      for (int i = 1; i <= kDegree; i += 2) ascending[i] *= sign;
      double found[kDegree];
      const int found_count = roots_in_unit_interval(ascending, found);
      for (int i = 0; i < found_count && count < kDegree; ++i) roots[count++] = {sign * found[i], is_inverse};
    }
  }
  return count;
}

}  // namespace mono_pose_tracker
