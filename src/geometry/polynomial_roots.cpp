#include "mono_pose_tracker/geometry/polynomial_roots.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

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
  const double largest = std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2]), std::abs(c[3])});
  if (!std::isfinite(largest) || largest == 0) return 0;
  if (std::abs(c[0]) <= kVanishing * largest) {
    if (std::abs(c[1]) > kVanishing * largest) return real_quadratic_roots(c + 1, roots);
    if (std::abs(c[2]) <= kVanishing * largest) return 0;
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

int real_roots_degree10(const double c[11], double roots[10]) {
  Eigen::Matrix<double, 10, 10> companion = Eigen::Matrix<double, 10, 10>::Zero();
  for (int i = 0; i < 10; ++i) companion(0, i) = -c[9 - i] / c[10];
  companion.diagonal<-1>().setOnes();
  if (!companion.allFinite()) return 0;
  const Eigen::EigenSolver<Eigen::Matrix<double, 10, 10>> solver(companion, false);
  if (solver.info() != Eigen::Success) return 0;
  int count = 0;
  for (int i = 0; i < 10; ++i) {
    const auto root = solver.eigenvalues()[i];
    // A double root splits by the square root of the rounding.
    if (std::abs(root.imag()) <= 1e-7 * (1 + std::abs(root.real()))) roots[count++] = root.real();
  }
  return count;
}

}  // namespace mono_pose_tracker
