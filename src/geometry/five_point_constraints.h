#pragma once

#include <Eigen/Core>

#include "null_space.h"

namespace mono_pose_tracker {

// Where the camera nearly only turns, every translation nearly fits, and Nister's ten constraints become
// nearly dependent. So the first view is turned until the pairs nearly agree, and E is written as
//   E = [s]x + scale (B - tr(B) I),   B symmetric,   scale = the parallax left,
// in which s and B are of one size, and E is essential if and only if
//   det B = 0,   adj(B) s = 0,   [s]x B [s]x = scale^2 tr(B) adj(B):
// ten cubics in which no digits are lost at any scale. At scale 0 they are the constraints of the
// differential epipolar geometry (Ma, Kosecka and Sastry 2000), at scale 1 with no turn combinations of
// Nister's.

// Entries of a solution: s, and the upper triangle of B.
enum Entry { kS1, kS2, kS3, kB11, kB22, kB33, kB23, kB13, kB12 };

/// The 10x20 matrix of the constraints, columns in Nister's order:
/// xxx yyy xxy xyy xxz xx yyz yy xyz xy | xzz xz x yzz yz y zzz zz z 1
using Constraints = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;

/// The constraints on the solutions that a basis spans, its coefficients x, y, z and 1.
Constraints essential_constraints(const Row10 (&basis)[4], double scale);

}  // namespace mono_pose_tracker
