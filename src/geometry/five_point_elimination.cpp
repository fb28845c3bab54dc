#include "five_point_elimination.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mono_pose_tracker {
namespace {

/// c[0] + c[1] z + ..., or its reverse for a root given as 1/z.
template <int N>
double evaluate(const double (&c)[N], const ProjectiveRoot& root) {
  double value = root.is_inverse ? c[0] : c[N - 1];
  for (int i = 1; i < N; ++i) value = value * root.value + (root.is_inverse ? c[i] : c[N - 1 - i]);
  return value;
}

}  // namespace

double eliminate(Constraints* m, int (&rows)[10]) {
  for (int k = 0; k < 10; ++k) rows[k] = k;
  double least = std::numeric_limits<double>::infinity(), largest = 0;
  // Unrolled, so that what is left of each row has a length that the compiler knows.
#pragma GCC unroll 10
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

}  // namespace mono_pose_tracker
