#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// Seeded random numbers, the same on every platform (the standard library's distributions are not):
/// the SplitMix64 generator of Steele, Lea and Flood (2014). Not shared between threads.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  /// Uniform in [0, n); n > 0. Bias below n / 2^32.
  std::uint32_t index(std::uint32_t n) { return static_cast<std::uint32_t>(((next() >> 32) * n) >> 32); }

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal (Box and Muller, one of the pair: keeps the generator stateless but for its seed).
  double normal() {
    const double u = 1.0 - uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586 * uniform());
  }

 private:
  std::uint64_t state_;
};

/// The upper median; 0 of nothing.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// The sigma of either component of two-dimensional normal errors, from their lengths, some of which may be
/// outliers: the median over that of a Rayleigh distribution of sigma 1, sqrt(2 ln 2). 0 of nothing.
inline double sigma_of_lengths(std::vector<double> lengths) { return median(std::move(lengths)) / 1.1774; }

/// The variance of each component of three-dimensional normal errors, from the median of their squared
/// lengths, which is that of chi-squared with three degrees of freedom for a variance of 1.
inline double variance_of_median_square(double median_square) { return median_square / 2.366; }

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

/// Probability that Student's t of this many degrees of freedom (>= 1) exceeds a value (Abramowitz and Stegun
/// 1964, 26.7.3 and 26.7.4).
inline double student_tail(double t, int degrees) {
  const double angle = std::atan2(std::abs(t), std::sqrt(degrees)), cosine = std::cos(angle);
  const bool is_odd = degrees % 2 != 0;
  double term = is_odd ? cosine : 1, sum = degrees == 1 ? 0 : term;
  for (int k = is_odd ? 3 : 2; k <= degrees - 2; k += 2) {
    term *= cosine * cosine * (k - 1) / k;
    sum += term;
  }
  const double within = is_odd ? (angle + std::sin(angle) * sum) / std::acos(0.0) : std::sin(angle) * sum;
  const double tail = std::max(0.0, (1 - within) / 2);
  return t >= 0 ? tail : 1 - tail;
}

/// Probability that one hypothesis costs so much more than another by chance, if it were no worse: Student's
/// t-test of the differences of costs of independent data (Vuong 1989). 1 where it does not cost more by
/// min_extra, a share of the other's cost.
inline double p_value_of_extra_cost(const std::vector<double>& costs, const std::vector<double>& others,
                                    double min_extra) {
  const auto count = static_cast<double>(costs.size());
  double other = 0, sum = 0, squared = 0;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const double difference = costs[i] - others[i];
    other += others[i];
    sum += difference;
    squared += difference * difference;
  }
  const double variance = (squared - sum * sum / count) / (count - 1);  // of a difference
  if (count < 2 || variance <= 0 || sum <= min_extra * other) return 1;
  return student_tail(sum / std::sqrt(count * variance), static_cast<int>(count) - 1);
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

/// The value below which a share of the sorted values lies, between two of them by proportion; 0 of none.
inline double quantile_of_sorted(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  const double position = share * static_cast<double>(sorted.size() - 1);
  const std::size_t below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (position - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace mono_pose_tracker
