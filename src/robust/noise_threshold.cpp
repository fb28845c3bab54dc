#include "robust/noise_threshold.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

namespace {

constexpr double kQuantile[] = {3, 3.44};  // of 99.73 %, by the number of components less one

// Mean square of a component of normal errors of unit deviation, of those that are at most c long.
double mean_square_within(double c, int components) {
  const double density = std::exp(-0.5 * c * c);
  return components == 1 ? 1 - c * std::sqrt(2 / M_PI) * density / std::erf(c * std::sqrt(0.5))
                         : 1 - 0.5 * c * c * density / (1 - density);
}

// Standard deviation of a component of normal errors, given its mean square in those not beyond `limit`; at
// most limit / 1.5, where the errors are nearly uniform up to the limit.
double sigma_before_cut(double mean_square, double limit, int components) {
  double sigma = std::sqrt(mean_square);
  for (int i = 0; i < 20; ++i) {
    const double c = limit / std::max(sigma, 1e-3 * limit);
    sigma = std::min(std::sqrt(mean_square / mean_square_within(c, components)), limit / 1.5);
  }
  return sigma;
}

}  // namespace

double noise_threshold(const RansacScore& score, int num_data, double threshold, int components,
                       int parameters) {
  const double outliers_cost = (num_data - score.num_inliers) * threshold * threshold;
  const int freedom = std::max(1, score.num_inliers * components - parameters);
  const double mean_square = std::max(0.0, score.cost - outliers_cost) / freedom;
  return std::max(threshold,
                  kQuantile[components - 1] * sigma_before_cut(mean_square, threshold, components));
}

bool noise_explains(int num_beyond, int num_data, double threshold, double wide, double deviations) {
  // Of errors with two components, exp(-k) are beyond the threshold, and exp(-end) beyond `wide`.
  const double end = 0.5 * kQuantile[1] * kQuantile[1];
  const double k = end * threshold * threshold / (wide * wide), tail = std::exp(-k), last = std::exp(-end);
  if (num_beyond == 0 || !(tail > last)) return true;
  const double share = (tail - last) / (1 - last);
  // Of one datum: of the count, and of the deviation estimated from the data within the threshold, through
  // their Fisher information about it.
  const double information = 1 - k * k * tail / ((1 - tail) * (1 - tail));
  const double variance = share * (1 - share) + k * k * tail * tail / information;
  return num_beyond <= num_data * share + deviations * std::sqrt(num_data * variance);
}

}  // namespace mono_pose_tracker
