#pragma once

namespace mono_pose_tracker {

/// Real roots of c[0] x^2 + c[1] x + c[2], c[0] != 0, by the formula that does not cancel. Ascending; returns
/// how many (a double root counts twice).
int real_quadratic_roots(const double c[3], double roots[2]);

/// Real roots of c[0] x^3 + c[1] x^2 + c[2] x + c[3]; a leading coefficient that vanishes against the others
/// leaves the quadratic. Returns how many, each polished by Newton's method.
int real_cubic_roots(const double c[4], double roots[3]);

/// A real number z, as 1/value where |z| > 1, so that infinity is no exception.
struct ProjectiveRoot {
  double value;  // in [-1, 1]
  bool is_inverse;
};

/// Real roots of c[0] + c[1] z + ... + c[10] z^10: isolated by Descartes' rule of signs on Bernstein
/// coefficients (Lane and Riesenfeld 1981), then refined by Newton's method. Roots closer together than 1e-6,
/// or complex pairs as close to the real line, are reported as two roots at the ends of an interval around
/// them. Returns how many.
int real_roots_degree10(const double c[11], ProjectiveRoot roots[10]);

}  // namespace mono_pose_tracker
