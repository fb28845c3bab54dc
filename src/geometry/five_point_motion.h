#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/geometry/motion.h"

namespace mono_pose_tracker {

/// Five pairs of unit bearings, the first view's turned so that the pairs nearly agree.
struct AlignedPairs {
  Eigen::Matrix3d turn;
  std::array<Eigen::Vector3d, 5> x1, x2;
  double parallax;  // sine of the angle that the turn leaves between the bearings of a pair, root mean square
};

AlignedPairs align(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2);

/// One of the motions of an essential matrix, its rotation orthogonal only as far as the matrix is essential.
/// Returns how far from it that is; infinity when there is none.
double rough_motion(const Eigen::Matrix3d& essential, Motion* motion);

/// Which of the four motions of an essential matrix have the pairs in front of both cameras: `twisted` is
/// turned by half a turn about t, (2 t t^T - I) R; `reversed` has -t.
struct Fronts {
  bool as_is = true, reversed = true, twisted = true, twisted_reversed = true;
  bool any() const { return as_is | reversed | twisted | twisted_reversed; }
};

/// The distances along the rays may fall short by tolerance |t x x2|.
Fronts fronts_of(const Motion& motion, const AlignedPairs& pairs, double tolerance);

/// Newton's method on the five epipolar constraints over rotation and direction of translation, so that E
/// stays an essential matrix. Returns the length of the first step in radians: how far off it found the
/// motion; infinity when it does not converge.
double polish(const AlignedPairs& pairs, Motion* motion);

}  // namespace mono_pose_tracker
