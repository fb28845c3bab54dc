#pragma once

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

/// Number of standard deviations by which `count` of `total` exceeds the expectation for the share
/// `usual_share` (binomial). The variance is at least that of one event.
inline double deviations_above(double usual_share, int count, int total) {
  const double usual = usual_share * total;
  return (count - usual) / std::sqrt(std::max(1.0, usual * (1 - usual_share)));
}

}  // namespace mono_pose_tracker
