#include "robust/two_view_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "common/toolchain.h"
#include "levenberg_marquardt.h"
#include "robust/noise_threshold.h"

namespace mono_pose_tracker {

namespace {

// Of an angle, rad: with the larger one no pair is behind a camera.
double tolerance_of(PairsThatCount which, double threshold) {
  return which == PairsThatCount::kAll ? 1e100 : threshold;
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
  const MotionRows motion(model);
  double sums[kBlockSize] = {}, squared[kBlockSize];
  for (int begin = 0; begin < pairs.size(); begin += kBlockSize) {
    squared_errors(PairBlock(pairs, begin), motion, tolerance_of(which, threshold), squared_threshold,
                   squared);
    for (int i = 0; i < kBlockSize; ++i) sums[i] += std::min(squared[i], squared_threshold);
  }
  return std::accumulate(std::begin(sums), std::end(sums), 0.0);  // the padding's errors are zero
}

using Equations = NormalEquations<5>;

// The lower triangle of the information row by row, each row followed by its gradient.
constexpr int kSums = 20;

// Adds the equations of a block to sums, one of each pair's place in its block. Parameters: R' = exp(w) R, t'
// = (t + basis d) normalised; order w, d. basis: one vector after the other.
MPT_FUNCTION_CLONES_FOR("avx2")
void add_equations(const PairBlock& block, const MotionRows& motion, const double (&basis)[6],
                   double tolerance, double squared_threshold, double (&__restrict sums)[kSums][kBlockSize]) {
  const auto& t = motion.t;
  for (int i = 0; i < kBlockSize; ++i) {
    const PairUnderMotion p = under_motion(block, motion, tolerance, i);
    const double weight = p.squared(squared_threshold) < squared_threshold ? p.inverse : 0;
    const double constraint = p.constraint;
    // How the error's denominator changes it.
    const double shape1 = constraint * p.inverse * p.along1, shape2 = constraint * p.inverse * p.along2;
    const double mx = p.nx + shape1 * t[0], my = p.ny + shape1 * t[1], mz = p.nz + shape1 * t[2];
    const double tx = p.y * p.w - p.z * p.v + shape1 * p.x + shape2 * p.u;
    const double ty = p.z * p.u - p.x * p.w + shape1 * p.y + shape2 * p.v;
    const double tz = p.x * p.v - p.y * p.u + shape1 * p.z + shape2 * p.w;
    const double a = p.y * mz - p.z * my, b = p.z * mx - p.x * mz, c = p.x * my - p.y * mx;
    const double d = basis[0] * tx + basis[1] * ty + basis[2] * tz;
    const double e = basis[3] * tx + basis[4] * ty + basis[5] * tz;
    const double wa = weight * a, wb = weight * b, wc = weight * c, wd = weight * d, we = weight * e;
    sums[0][i] += wa * a;
    sums[1][i] += wa * constraint;
    sums[2][i] += wb * a;
    sums[3][i] += wb * b;
    sums[4][i] += wb * constraint;
    sums[5][i] += wc * a;
    sums[6][i] += wc * b;
    sums[7][i] += wc * c;
    sums[8][i] += wc * constraint;
    sums[9][i] += wd * a;
    sums[10][i] += wd * b;
    sums[11][i] += wd * c;
    sums[12][i] += wd * d;
    sums[13][i] += wd * constraint;
    sums[14][i] += we * a;
    sums[15][i] += we * b;
    sums[16][i] += we * c;
    sums[17][i] += we * d;
    sums[18][i] += we * e;
    sums[19][i] += we * constraint;
  }
}

Equations linearize(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                    PairsThatCount which) {
  const MotionRows motion(model);
  double basis[6], sums[kSums][kBlockSize] = {};
  Eigen::Map<Eigen::Matrix<double, 3, 2>>(basis) << tangent_basis(model.translation);
  for (int begin = 0; begin < pairs.size(); begin += kBlockSize) {
    add_equations(PairBlock(pairs, begin), motion, basis, tolerance_of(which, threshold),
                  threshold * threshold, sums);
  }
  Equations equations;
  const auto* sum = sums;
  const auto next = [&sum] {
    const auto& of_block = *sum++;
    return std::accumulate(std::begin(of_block), std::end(of_block), 0.0);
  };
  for (int a = 0; a < 5; ++a) {
    for (int b = 0; b <= a; ++b) equations.information(a, b) = equations.information(b, a) = next();
    equations.gradient[a] = next();
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
                       TwoViewModel* model, const InnerSamplingOptions& options) {
  Random random(seed);
  double best = refine_two_views(pairs, threshold, options.iterations, model);
  std::vector<char> inliers;
  int in_vain = 0;
  for (int sample = 0; sample < samples && in_vain < options.most_in_vain; ++sample) {
    const RansacScore score =
        score_two_views(pairs, *model, threshold, std::numeric_limits<double>::infinity(), &inliers);
    const int size = std::min(options.sample_size, score.num_inliers / 2);
    if (size < options.least_sample_size) return;
    TwoViewModel candidate = *model;
    refine_two_views(some_of(pairs, inliers, size, &random), options.all_count, options.sample_iterations,
                     &candidate);
    const double cost = refine_two_views(pairs, threshold, options.iterations, &candidate);
    ++in_vain;
    if (cost < best) {
      in_vain = cost < (1 - options.min_decrease) * best ? 0 : in_vain;
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
