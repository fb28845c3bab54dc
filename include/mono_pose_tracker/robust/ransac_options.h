#pragma once

#include <cstdint>

namespace mono_pose_tracker {

/// Random sample consensus (Fischler and Bolles 1981) with MSAC scores and local optimisation.
struct RansacOptions {
  double threshold = 0.003;     // largest error of an inlier: radians for the estimators on bearings
  double confidence = 0.9999;   // probability that the best model was sampled at least once
  int min_iterations = 50;
  int max_iterations = 5000;
  std::uint64_t seed = 0;
};

}  // namespace mono_pose_tracker
