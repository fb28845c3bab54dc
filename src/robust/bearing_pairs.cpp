#include "robust/bearing_pairs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/toolchain.h"
#include "shuffled_indices.h"

namespace mono_pose_tracker {

BearingPairs::BearingPairs(const std::vector<Eigen::Vector3d>& bearings1,
                           const std::vector<Eigen::Vector3d>& bearings2, std::uint64_t seed)
    : source_(shuffled_indices(bearings1.size(), seed, [&](std::size_t i) {
        const double norms = bearings1[i].norm() * bearings2[i].norm();
        return std::isfinite(norms) && norms > 0;
      })) {
  std::vector<Eigen::Vector3d> first, second;
  first.reserve(source_.size());
  second.reserve(source_.size());
  for (const int i : source_) {
    first.push_back(bearings1[i].normalized());
    second.push_back(bearings2[i].normalized());
  }
  first_ = VectorArray(first);
  second_ = VectorArray(second);
}

BearingPairs BearingPairs::with(const std::vector<char>& flags) const {
  std::vector<Eigen::Vector3d> first, second;
  for (int i = 0; i < size(); ++i) {
    if (!flags[i]) continue;
    first.push_back(first_[i]);
    second.push_back(second_[i]);
  }
  return {first, second, 0};
}

PairBlock::PairBlock(const BearingPairs& pairs, int begin) {
  for (int axis = 0; axis < 3; ++axis) {
    x1[axis] = pairs.first().from(axis, begin);
    x2[axis] = pairs.second().from(axis, begin);
  }
}

MotionRows::MotionRows(const TwoViewModel& model) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r) << model.rotation;
  Eigen::Map<Eigen::Vector3d>(t) << model.translation;
}

// lambda1 R x1 + t = lambda2 x2 in the plane of the two rays: both distances, times sin^2 of the angle
// between the rays, are at least -tolerance * |t x x2|.
bool may_be_in_front(const TwoViewModel& model, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2, double tolerance) {
  const Eigen::Vector3d turned = model.rotation * bearing1;
  const double along1 = model.translation.dot(turned), along2 = model.translation.dot(bearing2);
  const double cosine = turned.dot(bearing2);
  const double slack = -tolerance * std::sqrt(std::max(0.0, 1 - along2 * along2));
  return along2 * cosine - along1 > slack && along2 - along1 * cosine > slack;
}

MPT_FUNCTION_CLONES_FOR("avx2")
void squared_errors(const PairBlock& block, const MotionRows& motion, double tolerance, double behind,
                    double (&__restrict squared)[kBlockSize]) {
  for (int i = 0; i < kBlockSize; ++i) squared[i] = under_motion(block, motion, tolerance, i).squared(behind);
}

RansacScore score_two_views(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                            double cost_bound, std::vector<char>* inliers) {
  const MotionRows motion(model);
  const auto squared_of = [&](int begin, double(&squared)[kBlockSize]) {
    squared_errors(PairBlock(pairs, begin), motion, threshold, threshold * threshold, squared);
  };
  return score_pairs(pairs.size(), threshold, cost_bound, squared_of, inliers);
}

}  // namespace mono_pose_tracker
