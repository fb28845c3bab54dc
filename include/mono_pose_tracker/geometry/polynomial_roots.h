#pragma once

namespace mono_pose_tracker {

/// Real roots of c[0] x^2 + c[1] x + c[2], c[0] != 0, by the formula that does not cancel. Ascending; returns
/// how many (a double root counts twice).
int real_quadratic_roots(const double c[3], double roots[2]);

/// Real roots of c[0] x^3 + c[1] x^2 + c[2] x + c[3]; a leading coefficient that vanishes against the others
/// leaves the quadratic. Returns how many, each polished by Newton's method.
int real_cubic_roots(const double c[4], double roots[3]);

/// Real roots of sum c[i] x^i, i = 0..10 (c[10] the leading coefficient). Returns how many.
int real_roots_degree10(const double c[11], double roots[10]);

}  // namespace mono_pose_tracker
