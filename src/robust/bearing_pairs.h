#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "mono_pose_tracker/geometry/motion.h"
#include "robust/early_rejection.h"
#include "robust/packets.h"
#include "robust/ransac.h"

namespace mono_pose_tracker {

/// |t x R x1|^2 + |t x x2|^2 is at least this: keeps a pair at both epipoles, which says nothing, from
/// dividing zero by zero.
constexpr double kTinySine = 1e-15;

/// Matched unit bearings of two views, coordinate by coordinate (what compilers make vector code of), in a
/// seeded random order (so that the first few are a fair sample), without pairs that are not finite.
class BearingPairs {
 public:
  BearingPairs(const std::vector<Eigen::Vector3d>& bearings1, const std::vector<Eigen::Vector3d>& bearings2,
               std::uint64_t seed);

  int size() const { return static_cast<int>(source_.size()); }
  const VectorArray& first() const { return first_; }
  const VectorArray& second() const { return second_; }
  BearingPairs with(const std::vector<char>& flags) const;  // those that have a flag
  int source(int i) const { return source_[i]; }            // index in the vectors this was made of

 private:
  VectorArray first_, second_;
  std::vector<int> source_;
};

using TwoViewModel = Motion;  // second_from_first, the translation of unit length

/// True when the rays meet in front of both cameras, or may do so within an angular error (radians): the rays
/// of a far point are parallel but for noise.
bool may_be_in_front(const TwoViewModel& model, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2, double tolerance);

/// Coordinates of a block of pairs, one axis after the other, and a motion: R row by row, then t.
struct PairBlock {
  PairBlock(const BearingPairs& pairs, int begin);
  const double *x1[3], *x2[3];
};
struct MotionRows {
  explicit MotionRows(const TwoViewModel& model);
  double r[9], t[3];
};

/// A pair of a block under a motion. The Sampson error is the distance, on both unit spheres together, to the
/// nearest pair that satisfies the epipolar constraint: x2 . (t x R x1) / sqrt(|t x R x1|^2 + |t x x2|^2).
struct PairUnderMotion {
  double x, y, z;                        // R x1
  double u, v, w;                        // x2
  double nx, ny, nz;                     // x2 x t
  double constraint;                     // R x1 . (x2 x t)
  double along1, along2;                 // t . R x1, t . x2
  double inverse;                        // of |t x R x1|^2 + |t x x2|^2
  bool in_front;                         // of both cameras, within the tolerance (may_be_in_front)
  double squared(double behind) const {  // error; `behind` is added to that of a pair behind a camera
    return constraint * constraint * inverse + (in_front ? 0 : behind);
  }
};

[[gnu::always_inline]] inline PairUnderMotion under_motion(const PairBlock& block, const MotionRows& motion,
                                                           double tolerance, int i) {
  const auto& [x1, x2] = block;
  const auto& [r, t] = motion;
  PairUnderMotion p;
  p.x = r[0] * x1[0][i] + r[1] * x1[1][i] + r[2] * x1[2][i];
  p.y = r[3] * x1[0][i] + r[4] * x1[1][i] + r[5] * x1[2][i];
  p.z = r[6] * x1[0][i] + r[7] * x1[1][i] + r[8] * x1[2][i];
  p.u = x2[0][i], p.v = x2[1][i], p.w = x2[2][i];
  p.nx = p.v * t[2] - p.w * t[1], p.ny = p.w * t[0] - p.u * t[2], p.nz = p.u * t[1] - p.v * t[0];
  p.constraint = p.x * p.nx + p.y * p.ny + p.z * p.nz;
  p.along1 = t[0] * p.x + t[1] * p.y + t[2] * p.z, p.along2 = t[0] * p.u + t[1] * p.v + t[2] * p.w;
  p.inverse = 1 / ((2 + kTinySine) - p.along1 * p.along1 - p.along2 * p.along2);
  // The lesser distance, squared with its sign.
  const double cosine = p.x * p.u + p.y * p.v + p.z * p.w;
  const double nearest = std::min(p.along2 * cosine - p.along1, p.along2 - p.along1 * cosine);
  p.in_front = nearest * std::abs(nearest) > tolerance * tolerance * (p.along2 * p.along2 - (1 + kTinySine));
  return p;
}

/// The errors of a block.
void squared_errors(const PairBlock& block, const MotionRows& motion, double tolerance, double behind,
                    double (&__restrict squared)[kBlockSize]);

/// MSAC: the sum of min(e^2, threshold^2) over the errors of `count` pairs, in blocks: squared_of(begin,
/// squared) writes those of a block, rad^2. Gives up with an infinite cost when it exceeds cost_bound or is
/// all but sure to. inliers, if given, gets a flag a pair.
template <class SquaredOf>
RansacScore score_pairs(int count, double threshold, double cost_bound, const SquaredOf& squared_of,
                        std::vector<char>* inliers = nullptr) {
  const double squared_threshold = threshold * threshold;
  const double mean_bound = cost_bound / (squared_threshold * count);
  if (inliers != nullptr) inliers->resize(count);
  RansacScore score;
  score.cost = 0;
  double squared[kBlockSize];
  for (int begin = 0; begin < count; begin += kBlockSize) {
    const int end = std::min(begin + kBlockSize, count);
    squared_of(begin, squared);
    for (int i = begin; i < end; ++i) {
      const bool is_inlier = squared[i - begin] < squared_threshold;
      score.cost += is_inlier ? squared[i - begin] : squared_threshold;
      score.num_inliers += is_inlier;
      if (inliers != nullptr) (*inliers)[i] = is_inlier;
    }
    if (score.cost >= cost_bound || is_hopeless(score.cost / (squared_threshold * end), end, mean_bound)) {
      return RansacScore();
    }
  }
  return score;
}

/// score_pairs of Sampson errors on the unit sphere; pairs behind a camera count as outliers.
RansacScore score_two_views(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                            double cost_bound, std::vector<char>* inliers = nullptr);

}  // namespace mono_pose_tracker
