#pragma once

#include <cmath>

namespace mono_pose_tracker {

/// Whether a model may be given up after the first `count` data of a random order. Costs are in [0, 1], and
/// means over data: so_far of the first ones, bound of the model to be beaten over all. A model as good as
/// the bound would look this bad on its first data with a probability below e^-log_odds, by Hoeffding's
/// inequality (1963, theorem 1), which is exact where nearly all costs are 1. The default, one in 700, loses
/// far fewer good samples than the confidence leaves to chance.
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
