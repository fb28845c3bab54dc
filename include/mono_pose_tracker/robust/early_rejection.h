#pragma once

#include <cmath>

namespace mono_pose_tracker {

/// Whether a model may be given up after the first `count` data of a random order. Costs are means over data,
/// in [0, 1] each: so_far of the first ones, bound of the model to be beaten over all. Data of a model as
/// good as the bound would cost as much as so_far less than once in 700 times (3 standard deviations), which
/// costs far fewer good samples than the confidence leaves to chance.
inline bool is_hopeless(double so_far, int count, double bound) {
  const double excess = so_far - bound;
  return excess > 0 && excess * excess * count > 9 * bound * (1 - bound);
}

}  // namespace mono_pose_tracker
