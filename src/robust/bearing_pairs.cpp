#include "robust/bearing_pairs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "robust/early_rejection.h"
#include "shuffled_indices.h"

namespace mono_pose_tracker {

namespace {

constexpr int kBlock = 64;  // pairs whose errors are computed at once; scoring may give up between blocks
struct BlockErrors {
  double squared[kBlock];  // Sampson errors, rad^2
  double along1[kBlock];   // t . R x1
  double along2[kBlock];   // t . x2
};

Eigen::Matrix3d essential_of(const TwoViewModel& model) {
  Eigen::Matrix3d essential;
  for (int c = 0; c < 3; ++c) {
    essential.col(c) = model.translation.cross(model.rotation.col(c));
  }
  return essential;
}

// e = x2 . (t x R x1) / sqrt(|t x R x1|^2 + |t x x2|^2): the distance, on both unit spheres together, to the
// nearest pair that satisfies the epipolar constraint.
void sampson_errors(const BearingPairs& pairs, const TwoViewModel& model, const Eigen::Matrix3d& essential,
                    int begin, int count, BlockErrors* block) {
  const Eigen::Vector3d t_in_first = model.rotation.transpose() * model.translation;
  for (int i = 0; i < count; i += kPacketSize) {
    const PacketVector x1 = pairs.first().packet(begin + i);
    const PacketVector x2 = pairs.second().packet(begin + i);
    const Packet constraint = dot(x2, essential * x1);
    const Packet along1 = dot(t_in_first, x1);
    const Packet along2 = dot(model.translation, x2);
    Eigen::Map<Packet>(block->squared + i) =
        constraint * constraint / ((2 + kTinySine) - along1 * along1 - along2 * along2);
    Eigen::Map<Packet>(block->along1 + i) = along1;
    Eigen::Map<Packet>(block->along2 + i) = along2;
  }
}

// As may_be_in_front. lambda1 R x1 + t = lambda2 x2 in the plane of the two rays: both distances, times sin^2
// of the angle between the rays, are at least -tolerance * |t x x2|.
bool distances_positive(double along1, double along2, double cosine, double tolerance) {
  const double scaled1 = along2 * cosine - along1;
  const double scaled2 = along2 - along1 * cosine;
  const double slack = -tolerance * std::sqrt(std::max(0.0, 1 - along2 * along2));
  return scaled1 > slack && scaled2 > slack;
}

}  // namespace

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

bool may_be_in_front(const TwoViewModel& model, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2, double tolerance) {
  const Eigen::Vector3d turned = model.rotation * bearing1;
  return distances_positive(model.translation.dot(turned), model.translation.dot(bearing2),
                            turned.dot(bearing2), tolerance);
}

RansacScore score_two_views(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                            double cost_bound, std::vector<char>* inliers) {
  const double squared_threshold = threshold * threshold;
  const double mean_bound = cost_bound / (squared_threshold * pairs.size());
  if (inliers != nullptr) {
    inliers->assign(pairs.size(), 0);
  }
  const Eigen::Matrix3d essential = essential_of(model);
  RansacScore score;
  score.cost = 0;
  BlockErrors block;
  for (int begin = 0; begin < pairs.size(); begin += kBlock) {
    const int count = std::min(kBlock, pairs.size() - begin);
    sampson_errors(pairs, model, essential, begin, count, &block);
    for (int i = 0; i < count; ++i) {
      if (!(block.squared[i] < squared_threshold)) {
        score.cost += squared_threshold;
        continue;
      }
      const double cosine = (model.rotation * pairs.first()[begin + i]).dot(pairs.second()[begin + i]);
      if (!distances_positive(block.along1[i], block.along2[i], cosine, threshold)) {
        score.cost += squared_threshold;
        continue;
      }
      score.cost += block.squared[i];
      ++score.num_inliers;
      if (inliers != nullptr) {
        (*inliers)[begin + i] = 1;
      }
    }
    const int scored = begin + count;
    if (score.cost >= cost_bound ||
        is_hopeless(score.cost / (squared_threshold * scored), scored, mean_bound)) {
      return RansacScore();
    }
  }
  return score;
}

}  // namespace mono_pose_tracker
