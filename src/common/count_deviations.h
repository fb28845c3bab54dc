#pragma once

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

/// By how many standard deviations `count` of `total` exceeds what `usual_share` of them gives (binomial; a
/// share of nothing has a deviation, too: that of one).
inline double deviations_above(double usual_share, int count, int total) {
  const double usual = usual_share * total;
  return (count - usual) / std::sqrt(std::max(1.0, usual * (1 - usual_share)));
}

}  // namespace mono_pose_tracker
