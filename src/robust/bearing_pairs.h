#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/geometry/motion.h"
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

/// MSAC: the sum of min(e^2, threshold^2) over Sampson errors e on the unit sphere (radians); pairs behind a
/// camera count as outliers. Gives up with an infinite cost when it exceeds cost_bound or is all but sure to.
/// inliers, if given, gets a flag a pair.
RansacScore score_two_views(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                            double cost_bound, std::vector<char>* inliers = nullptr);

}  // namespace mono_pose_tracker
