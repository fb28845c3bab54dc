#pragma once

#include <algorithm>
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

}  // namespace mono_pose_tracker
