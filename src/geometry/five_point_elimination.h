#pragma once

#include <Eigen/Core>

#include "five_point_constraints.h"
#include "geometry/polynomial_roots.h"

namespace mono_pose_tracker {

/// Gauss-Jordan elimination with partial pivoting. Of the ten rows only the six led by xxz xx yyz yy xyz xy
/// are needed, so the first four are not cleared of later columns. rows[k] is where the row of leading
/// monomial k ended up. Returns the smallest pivot against the largest.
double eliminate(Constraints* m, int (&rows)[10]);

/// B(z) of the paper: three rows of a polynomial for x, one for y (degree 3) and one for 1 (degree 4),
/// ascending.
struct ZSystem {
  double x[3][4], y[3][4], one[3][5];
};

ZSystem z_system(const Constraints& m, const int (&rows)[10]);

/// <n> of the paper: det B(z), of degree ten, ascending.
void determinant(const ZSystem& b, double n[11]);

/// (x, y, z, 1) up to scale from the null vector of B(z): the longest cross product of two of its rows.
Eigen::Vector4d back_substitute(const ZSystem& b, const ProjectiveRoot& root);

}  // namespace mono_pose_tracker
