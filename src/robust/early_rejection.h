#pragma once

#include <cmath>

namespace mono_pose_tracker {

/// Whether a model can be rejected after the first `count` data of a random order. Costs are in [0, 1] and
/// means over data: so_far over the first ones, bound over all data for the model to be beaten. A model as
/// good as the bound is rejected with a probability below e^-log_odds (Hoeffding 1963, theorem 1; exact where
/// nearly all costs are 1). The default, 1 in 700, loses far fewer good samples than the RANSAC confidence
/// allows.
inline bool is_hopeless(double so_far, int count, double bound, double log_odds = 6.55) {
  const double excess = so_far - bound;
  // The divergence of the inequality is at most the excess squared over the variance.
  if (!(excess > 0 && excess * excess * count > log_odds * bound * (1 - bound))) return false;
  const double rest = 1 - so_far;
  const double divergence =
      so_far * std::log(so_far / bound) + (rest > 0 ? rest * std::log(rest / (1 - bound)) : 0.0);
  return count * divergence > log_odds;
}

}  // namespace mono_pose_tracker
