#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/median.h"

namespace mono_pose_tracker {

// `loss_width` times the spread of the residuals, given by their norms in sigmas; unchanged without
// residuals.
inline double loss_width_by_spread(double loss_width, std::vector<double> lengths) {
  if (lengths.empty()) return loss_width;
  // Below a tenth of a pixel it is the features' own quantisation that speaks; above one, outliers.
  return loss_width * std::clamp(sigma_of_lengths(std::move(lengths)), 0.1, 1.0);
}

}  // namespace mono_pose_tracker
