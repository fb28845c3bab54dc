#include "mono_pose_tracker/robust/relative_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "common/rotation.h"
#include "mono_pose_tracker/geometry/five_point.h"
#include "robust/accidental_matches.h"
#include "robust/bearing_pairs.h"
#include "robust/ransac.h"
#include "robust/two_view_ambiguity.h"
#include "robust/two_view_refinement.h"
#include "sample_consensus.h"

namespace mono_pose_tracker {

namespace {

using ScoredTwoViews = ScoredModel<TwoViewModel>;

double rotation_angle(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  // |A - B| = 2 sqrt(2) sin(angle / 2)
  return 2 * std::asin(std::min(1.0, (a - b).norm() / std::sqrt(8.0)));
}

class TwoViewEstimator {
 public:
  using Model = TwoViewModel;
  static constexpr int kSampleSize = 5;
  static constexpr int kMaxModels = 40;

  TwoViewEstimator(const BearingPairs& pairs, const RelativePoseOptions& options)
      : pairs_(pairs), options_(options), threshold_(options.ransac.threshold) {}

  int num_data() const { return pairs_.size(); }

  int solve(const std::array<int, 5>& sample, std::array<TwoViewModel, 40>* models) const {
    std::array<Eigen::Vector3d, 5> x1, x2;
    for (int k = 0; k < 5; ++k) {
      x1[k] = pairs_.first()[sample[k]];
      x2[k] = pairs_.second()[sample[k]];
    }
    return five_point(x1, x2, threshold_, models);
  }

  RansacScore score(const TwoViewModel& model, double cost_bound) const {
    return score_two_views(pairs_, model, threshold_, cost_bound);
  }

  void optimize(TwoViewModel* model) const {
    refine_two_views(pairs_, threshold_, options_.local_iterations, model);
  }

  bool is_equivalent(const TwoViewModel& a, const TwoViewModel& b) const {
    return rotation_angle(a.rotation, b.rotation) < options_.distinct_rotation &&
           angle_between(a.translation, b.translation) < options_.distinct_translation;
  }

 private:
  const BearingPairs& pairs_;
  const RelativePoseOptions& options_;
  double threshold_;
};

// The distinct local optima that models lead to, best first.
class LocalOptima {
 public:
  LocalOptima(const BearingPairs& pairs, const TwoViewEstimator& estimator,
              const RelativePoseOptions& options)
      : pairs_(pairs),
        estimator_(estimator),
        options_(options),
        threshold_(options.ransac.threshold),
        pool_(options.max_hypotheses) {}

  // Stops as soon as a model converges to a known optimum.
  void add(TwoViewModel model) {
    if (is_known(model)) {
      return;
    }
    refine_two_views(pairs_, threshold_, options_.local_iterations, &model, PairsThatCount::kAll);
    if (!is_known(model)) {
      refine_two_views(pairs_, threshold_, options_.final_iterations, &model);
    }
    insert(model);
  }

  // Searches around the best optimum for a better one. The others are not searched, to keep them diverse: in
  // the flat valleys of narrow views the search would lead many of them to one optimum.
  void explore_best(std::uint64_t seed) {
    change_best(
        [&](TwoViewModel* m) { explore_two_views(pairs_, threshold_, options_.inner_samples, seed, m); });
  }

  // Once no more are added: one that is not polished costs less than the best one polished.
  void polish_best(const PlaneFit& plane) {
    change_best([&](TwoViewModel* m) {
      if (options_.without_accidental_matches) {
        const std::vector<char> flags = more_than_chance(pairs_, *m, plane.normal, threshold_);
        polish_two_views(pairs_.with(flags), threshold_, options_.final_iterations, m);
      } else {
        polish_two_views(pairs_, threshold_, options_.final_iterations, m);
      }
    });
  }

  const std::vector<ScoredTwoViews>& models() { return pool_.models(); }
  const ScoredTwoViews& best() { return pool_.models().front(); }

 private:
  template <class Change>
  void change_best(const Change& change) {
    TwoViewModel& model = pool_.models().front().model;
    change(&model);
    pool_.models().front().score = estimator_.score(model, std::numeric_limits<double>::infinity());
  }

  void insert(const TwoViewModel& model) {
    const RansacScore score = estimator_.score(model, std::numeric_limits<double>::infinity());
    pool_.insert({model, score},
                 [&](const auto& a, const auto& b) { return estimator_.is_equivalent(a, b); });
  }

  bool is_known(const TwoViewModel& model) {
    return std::any_of(pool_.models().begin(), pool_.models().end(), [&](const ScoredTwoViews& known) {
      return estimator_.is_equivalent(known.model, model);
    });
  }

  const BearingPairs& pairs_;
  const TwoViewEstimator& estimator_;
  const RelativePoseOptions& options_;
  double threshold_;
  ModelPool<TwoViewModel> pool_;
};

void validate(const std::vector<Eigen::Vector3d>& bearings1, const std::vector<Eigen::Vector3d>& bearings2,
              const RelativePoseOptions& options) {
  options.ransac.validate();
  if (options.max_hypotheses < 1) {
    throw std::invalid_argument("RelativePoseOptions: max_hypotheses is " +
                                std::to_string(options.max_hypotheses) + ", expected at least 1");
  }
  if (!(options.distinct_rotation >= 0) || !(options.distinct_translation >= 0)) {
    throw std::invalid_argument(
        "RelativePoseOptions: distinct_rotation and distinct_translation must be at least 0");
  }
  if (options.local_iterations < 0 || options.final_iterations < 0 || options.inner_samples < 0 ||
      !(options.min_alternative_inliers >= 0 && options.min_alternative_inliers <= 1)) {
    throw std::invalid_argument(
        "RelativePoseOptions: local_iterations, final_iterations and inner_samples must be at least 0, "
        "min_alternative_inliers from 0 to 1");
  }
  if (bearings1.size() != bearings2.size()) {
    throw std::invalid_argument("estimate_relative_pose: " + std::to_string(bearings1.size()) +
                                " bearings in the first image, expected the number of the second image, " +
                                std::to_string(bearings2.size()));
  }
  require_quality_of_each(options.quality, bearings1.size(), "RelativePoseOptions", "pairs");
}

// A motion, its inliers and the plane of most of them.
struct Support {
  TwoViewModel motion;
  BearingPairs inliers;
  PlaneFit plane;
};

Support support_of(const TwoViewModel& motion, const BearingPairs& pairs, const RansacOptions& ransac) {
  std::vector<char> flags;
  score_two_views(pairs, motion, ransac.threshold, std::numeric_limits<double>::infinity(), &flags);
  const BearingPairs inliers = pairs.with(flags);
  return {motion, inliers, fit_plane(inliers, motion, ransac.threshold, ransac.seed)};
}

// Motions that are hard to distinguish from the best one: the second solution of the dominant plane, and
// motions with reversed or scaled rotation.
std::vector<TwoViewModel> ambiguous_motions(const Support& best, const RelativePoseOptions& options) {
  std::vector<TwoViewModel> motions;
  TwoViewModel motion;
  if (second_planar_solution(best.motion, best.plane.normal, &motion)) {
    motions.push_back(motion);
  }
  for (const double factor : options.rotation_factors) {
    if (turn_scaled(best.inliers, best.motion, factor, &motion)) {
      motions.push_back(motion);
    }
  }
  return motions;
}

RelativePoseHypothesis to_hypothesis(const BearingPairs& pairs, const ScoredTwoViews& scored,
                                     double threshold, std::size_t num_matches) {
  RelativePoseHypothesis hypothesis;
  std::vector<char> inliers;
  const RansacScore score =
      score_two_views(pairs, scored.model, threshold, std::numeric_limits<double>::infinity(), &inliers);
  hypothesis.second_from_first = Rigid3(scored.model.rotation, scored.model.translation);
  hypothesis.second_from_first.rotation.normalize();
  hypothesis.score = score.cost + (num_matches - pairs.size()) * threshold * threshold;
  hypothesis.num_inliers = score.num_inliers;
  hypothesis.inliers.assign(num_matches, 0);
  for (int i = 0; i < pairs.size(); ++i) {
    hypothesis.inliers[pairs.source(i)] = inliers[i];
  }
  return hypothesis;
}

}  // namespace

RelativePoseReport estimate_relative_pose(const std::vector<Eigen::Vector3d>& bearings1,
                                          const std::vector<Eigen::Vector3d>& bearings2,
                                          const RelativePoseOptions& options) {
  validate(bearings1, bearings2, options);
  RelativePoseReport report;
  const double threshold = options.ransac.threshold;
  const BearingPairs pairs(bearings1, bearings2, options.ransac.seed);
  if (pairs.size() < TwoViewEstimator::kSampleSize) {
    return report;
  }
  TwoViewEstimator estimator(pairs, options);
  const int num_alternatives = options.max_hypotheses > 1 ? options.max_hypotheses : 0;
  const RansacReport<TwoViewModel> sampled =
      sample_consensus(options.ransac, pairs, options.quality, estimator, num_alternatives);
  report.iterations = sampled.iterations;
  // Any five pairs fit some pose: only a sixth says anything.
  if (sampled.best.score.num_inliers <= TwoViewEstimator::kSampleSize) {
    return report;
  }

  LocalOptima optima(pairs, estimator, options);
  optima.add(sampled.best.model);
  for (const ScoredTwoViews& alternative : sampled.alternatives) {
    optima.add(alternative.model);
  }
  optima.explore_best(options.ransac.seed);
  Support best = support_of(optima.best().model, pairs, options.ransac);
  const double cost = optima.best().score.cost;
  for (const TwoViewModel& motion : ambiguous_motions(best, options)) {
    optima.add(motion);
  }
  if (optima.best().score.cost < cost) best = support_of(optima.best().model, pairs, options.ransac);
  const RotationFit rotation = fit_rotation(best.inliers, threshold, options.ransac.seed);
  report.plane_inliers = best.plane.num_inliers;
  report.rotation_only_inliers = rotation.num_inliers;
  report.rotation_only = Eigen::Quaterniond(rotation.rotation).normalized();
  optima.polish_best(best.plane);
  for (const ScoredTwoViews& optimum : optima.models()) {
    if (optimum.score.num_inliers >= options.min_alternative_inliers * optima.best().score.num_inliers) {
      report.hypotheses.push_back(to_hypothesis(pairs, optimum, threshold, bearings1.size()));
    }
  }
  report.success = true;
  return report;
}

bool is_same_geometry(const Rigid3& a, const Rigid3& b, double max_rotation, double max_translation) {
  return rotation_angle_between(a.rotation, b.rotation) < max_rotation &&
         angle_between(a.translation, b.translation) < max_translation;
}

}  // namespace mono_pose_tracker
