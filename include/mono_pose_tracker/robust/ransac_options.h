#pragma once

#include <cstdint>

#include "mono_pose_tracker/common/cancel_flag.h"

namespace mono_pose_tracker {

/// Random sample consensus (Fischler and Bolles 1981) with MSAC scores and local optimisation.
struct RansacOptions {
  double threshold =
      0.003;  // largest error of an inlier: radians for the estimators on bearings, in (0, 0.5]
  double confidence = 0.9999;  // probability that the best model was sampled at least once, in (0, 1)
  int min_iterations = 50;     // at least 0
  int max_iterations = 5000;   // at least 1 and min_iterations
  std::uint64_t seed = 0;
  CancelFlag cancelled = nullptr;  // once it is set: the best so far, of one sample at least

  /// Throws std::invalid_argument that names the option, its value and its range.
  void validate() const;
};

}  // namespace mono_pose_tracker
