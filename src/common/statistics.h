#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// The upper median; 0 of nothing.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// The sigma of either component of two-dimensional normal errors, from their lengths, some of which may be
/// outliers: the median over that of a Rayleigh distribution of sigma 1, sqrt(2 ln 2). 0 of nothing.
inline double sigma_of_lengths(std::vector<double> lengths) {
  constexpr double kRayleighMedian = 1.1774;
  return median(std::move(lengths)) / kRayleighMedian;
}

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

/// The voters, each with its distance.
using DistantVotes = std::vector<std::pair<float, bool>>;

/// Whether the majority of the nearest voters says yes; false without voters.
inline bool most_of_nearest(std::size_t voters, DistantVotes votes) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(voters, votes.size()));
  std::partial_sort(votes.begin(), votes.begin() + count, votes.end());
  return 2 * std::count_if(votes.begin(), votes.begin() + count, [](const auto& v) { return v.second; }) >
         count;
}

}  // namespace mono_pose_tracker
