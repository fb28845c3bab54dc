#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/robust/ransac_options.h"
#include "robust/sampler.h"

namespace mono_pose_tracker {

struct RansacScore {
  double cost = std::numeric_limits<double>::infinity();  // smaller is better
  int num_inliers = 0;
};

template <class Model>
struct ScoredModel {
  Model model;
  RansacScore score;
};

template <class Model>
struct RansacReport {
  ScoredModel<Model> best;  // locally optimised; cost infinite when no sample gave a model
  std::vector<ScoredModel<Model>> alternatives;  // other models as sampled, no two equivalent, best first
  int iterations = 0;
};

/// The best models so far, at most `capacity`, no two of them equivalent.
template <class Model>
class ModelPool {
 public:
  explicit ModelPool(int capacity) : capacity_(capacity) {}

  /// Only models with a lower cost than this are kept.
  double cost_bound() const {
    return static_cast<int>(models_.size()) < capacity_ ? std::numeric_limits<double>::infinity()
                                                        : (capacity_ == 0 ? 0 : models_.back().score.cost);
  }

  /// Replaces worse equivalent models; drops the candidate if an equivalent one is better.
  template <class IsEquivalent>
  void insert(const ScoredModel<Model>& candidate, const IsEquivalent& is_equivalent) {
    if (!(candidate.score.cost < cost_bound())) {
      return;
    }
    for (const auto& kept : models_) {
      if (kept.score.cost <= candidate.score.cost && is_equivalent(kept.model, candidate.model)) {
        return;
      }
    }
    models_.erase(
        std::remove_if(models_.begin(), models_.end(),
                       [&](const auto& kept) { return is_equivalent(kept.model, candidate.model); }),
        models_.end());
    const auto position =
        std::upper_bound(models_.begin(), models_.end(), candidate,
                         [](const auto& a, const auto& b) { return a.score.cost < b.score.cost; });
    models_.insert(position, candidate);
    if (static_cast<int>(models_.size()) > capacity_) {
      models_.pop_back();
    }
  }

  std::vector<ScoredModel<Model>>& models() { return models_; }

 private:
  int capacity_;
  std::vector<ScoredModel<Model>> models_;
};

/// Locally optimised RANSAC (Chum, Matas and Kittler 2003), independent of the geometry. An Estimator has
/// Model, kSampleSize, kMaxModels,
/// int num_data() const,
/// int solve(const std::array<int, kSampleSize>&, std::array<Model, kMaxModels>*): returns the number of
/// models,
/// RansacScore score(const Model&, double cost_bound) const: may stop with any cost >= cost_bound,
/// void optimize(Model*) const: improves a model with its inliers,
/// bool is_equivalent(const Model&, const Model&) const.
/// Keeps up to num_alternatives further models as sampled. num_data >= kSampleSize.
template <class Estimator, class Sampler>
RansacReport<typename Estimator::Model> ransac(const RansacOptions& options, Estimator& estimator,
                                               Sampler& sampler, int num_alternatives = 0) {
  using Model = typename Estimator::Model;
  Random random(options.seed);
  RansacReport<Model> report;
  ModelPool<Model> alternatives(num_alternatives);
  RansacScore best_sampled;
  const auto is_equivalent = [&](const Model& a, const Model& b) { return estimator.is_equivalent(a, b); };
  std::array<int, Estimator::kSampleSize> sample;
  std::array<Model, Estimator::kMaxModels> models;
  double needed = options.max_iterations;
  while (report.iterations < options.max_iterations &&
         (report.iterations < options.min_iterations || report.iterations < needed) &&
         !(report.iterations > 0 && is_set(options.cancelled))) {
    ++report.iterations;
    sampler.draw(&random, sample.data());
    const int num_models = estimator.solve(sample, &models);
    for (int m = 0; m < num_models; ++m) {
      const double bound = std::max(best_sampled.cost, alternatives.cost_bound());
      const ScoredModel<Model> sampled{
          models[m], estimator.score(models[m], num_alternatives > 0 ? bound : best_sampled.cost)};
      if (num_alternatives > 0) {
        alternatives.insert(sampled, is_equivalent);
      }
      if (!(sampled.score.cost < best_sampled.cost)) {
        continue;
      }
      best_sampled = sampled.score;
      ScoredModel<Model> optimized = sampled;
      estimator.optimize(&optimized.model);
      optimized.score = estimator.score(optimized.model, std::numeric_limits<double>::infinity());
      const ScoredModel<Model>& better = optimized.score.cost < sampled.score.cost ? optimized : sampled;
      if (better.score.cost < report.best.score.cost) {
        report.best = better;
        needed = ransac_iterations_needed(better.score.num_inliers, estimator.num_data(),
                                          Estimator::kSampleSize, options.confidence);
      }
    }
  }
  report.alternatives = std::move(alternatives.models());
  return report;
}

}  // namespace mono_pose_tracker
