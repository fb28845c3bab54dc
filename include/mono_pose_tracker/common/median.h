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

/// The sigma of each of two normal components, by the lengths of errors that may have outliers among them:
/// their median over that of a Rayleigh distribution of sigma 1, which is sqrt(2 ln 2). 0 of nothing.
inline double sigma_of_lengths(std::vector<double> lengths) {
  constexpr double kRayleighMedian = 1.1774;
  return median(std::move(lengths)) / kRayleighMedian;
}

}  // namespace mono_pose_tracker
