#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {

/// Distance of each of `found` from its truth, in the truth's unit, after alignment by the best similarity.
inline std::vector<double> aligned_errors(const std::vector<Eigen::Vector3d>& found,
                                          const std::vector<Eigen::Vector3d>& truth) {
  Sim3 truth_from_found;
  EXPECT_TRUE(align_sim3(found, truth, &truth_from_found));
  std::vector<double> errors;
  for (std::size_t i = 0; i < found.size(); ++i)
    errors.push_back((truth_from_found * found[i] - truth[i]).norm());
  return errors;
}

/// Root mean square of the distances.
inline double aligned_rmse(const std::vector<Eigen::Vector3d>& found,
                           const std::vector<Eigen::Vector3d>& truth) {
  double sum = 0;
  for (const double error : aligned_errors(found, truth)) sum += error * error;
  return std::sqrt(sum / static_cast<double>(found.size()));
}

}  // namespace mono_pose_tracker
