#include "robust/two_view_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "common/random.h"
#include "common/so3.h"
#include "levenberg_marquardt.h"
#include "robust/noise_threshold.h"

namespace mono_pose_tracker {

namespace {

using PacketFlags = Eigen::Array<bool, kPacketSize, 1>;

// Which of four pairs may be in front of both cameras, as in bearing_pairs.cpp. along1 and along2 are t . R
// x1 and t . x2, cosine is R x1 . x2.
PacketFlags distances_positive(const Packet& along1, const Packet& along2, const Packet& cosine,
                               double tolerance) {
  const Packet slack = -tolerance * (1 - along2 * along2).max(0.0).sqrt();
  return (along2 * cosine - along1 > slack) && (along2 - along1 * cosine > slack);
}

Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

// The pairs behind a camera cost as much as outliers, as in score_two_views.
double truncated_cost(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                      PairsThatCount which) {
  const double squared_threshold = threshold * threshold;
  const Eigen::Vector3d& t = model.translation;
  Packet cost = Packet::Zero();
  for (int i = 0; i < pairs.size(); i += kPacketSize) {
    const PacketVector x2 = pairs.second().packet(i);
    const PacketVector r = model.rotation * pairs.first().packet(i);
    const Packet constraint = dot(r, cross(x2, t));
    const Packet along1 = dot(t, r), along2 = dot(t, x2);
    const Packet squared = constraint * constraint / ((2 + kTinySine) - along1 * along1 - along2 * along2);
    const Packet truncated = squared.min(squared_threshold);
    cost +=
        which == PairsThatCount::kAll
            ? truncated
            : distances_positive(along1, along2, dot(r, x2), threshold).select(truncated, squared_threshold);
  }
  return cost.sum();  // the padding's errors are zero
}

using Equations = NormalEquations<5>;

// Parameters: R' = exp(w) R, t' = (t + basis d) normalised; order w, d. The padding adds rows of zeros.
Equations linearize(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                    PairsThatCount which) {
  const Eigen::Matrix<double, 3, 2> basis = tangent_basis(model.translation);
  const double squared_threshold = threshold * threshold;
  const Eigen::Vector3d& t = model.translation;
  const Eigen::Vector3d basis0 = basis.col(0), basis1 = basis.col(1);
  Packet sums[20];  // the lower triangle of the information row by row, each row followed by its gradient
  std::fill(std::begin(sums), std::end(sums), Packet::Zero());
  for (int i = 0; i < pairs.size(); i += kPacketSize) {
    const PacketVector x2 = pairs.second().packet(i);
    const PacketVector r = model.rotation * pairs.first().packet(i);
    const PacketVector x2_cross_t = cross(x2, t);
    const Packet constraint = dot(r, x2_cross_t);
    const Packet along1 = dot(t, r);
    const Packet along2 = dot(t, x2);
    const Packet inverse = 1 / ((2 + kTinySine) - along1 * along1 - along2 * along2);
    PacketFlags counts = constraint * constraint * inverse < squared_threshold;
    if (which == PairsThatCount::kInFront) {
      counts = counts && distances_positive(along1, along2, dot(r, x2), threshold);
    }
    const Packet weight = counts.select(inverse, Packet::Zero());
    const Packet shape = constraint * inverse;  // how the error's denominator changes it
    const Packet shape1 = shape * along1, shape2 = shape * along2;
    PacketVector by_rotation = x2_cross_t;
    by_rotation += PacketVector{shape1 * t.x(), shape1 * t.y(), shape1 * t.z()};
    by_rotation = cross(r, by_rotation);
    PacketVector by_translation = cross(r, x2);
    by_translation += shape1 * r;
    by_translation += shape2 * x2;
    const Packet row[5] = {by_rotation.x, by_rotation.y, by_rotation.z, dot(basis0, by_translation),
                           dot(basis1, by_translation)};
    int k = 0;
    for (int a = 0; a < 5; ++a) {
      const Packet weighted = weight * row[a];
      for (int b = 0; b <= a; ++b) {
        sums[k++] += weighted * row[b];
      }
      sums[k++] += weighted * constraint;
    }
  }
  Equations equations;
  int k = 0;
  for (int a = 0; a < 5; ++a) {
    for (int b = 0; b <= a; ++b) {
      equations.information(a, b) = equations.information(b, a) = sums[k++].sum();
    }
    equations.gradient[a] = sums[k++].sum();
  }
  return equations;
}

struct TwoViewProblem {
  const BearingPairs& pairs;
  double threshold;
  PairsThatCount which;

  double cost(const TwoViewModel& model) const { return truncated_cost(pairs, model, threshold, which); }
  Equations linearize(const TwoViewModel& model) const {
    return mono_pose_tracker::linearize(pairs, model, threshold, which);
  }
  TwoViewModel stepped(const TwoViewModel& model, const Eigen::Matrix<double, 5, 1>& step) const {
    TwoViewModel result;
    result.rotation = exp_so3_matrix(step.head<3>()) * model.rotation;
    result.translation = (model.translation + tangent_basis(model.translation) * step.tail<2>()).normalized();
    return result;
  }
};

// `count` of the pairs with a flag, at random.
BearingPairs some_of(const BearingPairs& pairs, const std::vector<char>& flags, int count, Random* random) {
  std::vector<int> flagged;
  for (int i = 0; i < pairs.size(); ++i) {
    if (flags[i]) flagged.push_back(i);
  }
  std::vector<Eigen::Vector3d> first, second;
  for (int i = 0; i < count; ++i) {
    std::swap(flagged[i], flagged[i + random->index(static_cast<std::uint32_t>(flagged.size() - i))]);
    first.push_back(pairs.first()[flagged[i]]);
    second.push_back(pairs.second()[flagged[i]]);
  }
  return {first, second, 0};
}

}  // namespace

double refine_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model,
                        PairsThatCount which) {
  // The floor keeps directions solvable that no pair constrains.
  return levenberg_marquardt(TwoViewProblem{pairs, threshold, which}, {max_iterations, 1e-8, 1e-12}, model);
}

void explore_two_views(const BearingPairs& pairs, double threshold, int samples, std::uint64_t seed,
                       TwoViewModel* model) {
  // Of the inliers, at most half: more would lead to where the model is already.
  constexpr int kSampleSize = 25, kLeastSampleSize = 8;
  constexpr int kSampleIterations = 4, kIterations = 25;
  constexpr double kAllCount = 0.4;      // rad, as good as no threshold
  constexpr int kMostInVain = 4;         // in a row: there is but one minimum, as far as this sees
  constexpr double kLowered = 1 - 1e-5;  // less is the same minimum
  Random random(seed);
  double best = refine_two_views(pairs, threshold, kIterations, model);
  std::vector<char> inliers;
  int in_vain = 0;
  for (int sample = 0; sample < samples && in_vain < kMostInVain; ++sample) {
    const RansacScore score =
        score_two_views(pairs, *model, threshold, std::numeric_limits<double>::infinity(), &inliers);
    const int size = std::min(kSampleSize, score.num_inliers / 2);
    if (size < kLeastSampleSize) return;
    TwoViewModel candidate = *model;
    refine_two_views(some_of(pairs, inliers, size, &random), kAllCount, kSampleIterations, &candidate);
    const double cost = refine_two_views(pairs, threshold, kIterations, &candidate);
    ++in_vain;
    if (cost < best) {
      in_vain = cost < kLowered * best ? 0 : in_vain;
      best = cost;
      *model = candidate;
    }
  }
}

void polish_two_views(const BearingPairs& pairs, double threshold, int max_iterations, TwoViewModel* model) {
  const RansacScore score =
      score_two_views(pairs, *model, threshold, std::numeric_limits<double>::infinity());
  const double wide = noise_threshold(score, pairs.size(), threshold, 1, 5);
  refine_two_views(pairs, wide, max_iterations, model);
}

}  // namespace mono_pose_tracker
