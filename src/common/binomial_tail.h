#pragma once

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

/// Probability of at least k of n events, where each has this probability.
inline double binomial_tail(int k, int n, double probability) {
  if (k <= 0) return 1;
  if (k > n || probability <= 0) return 0;
  if (probability >= 1) return 1;
  double sum = 0;
  for (int i = k; i <= n; ++i) {
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(i + 1.0) - std::lgamma(n - i + 1.0) +
                    i * std::log(probability) + (n - i) * std::log1p(-probability));
  }
  return std::min(1.0, sum);
}

}  // namespace mono_pose_tracker
