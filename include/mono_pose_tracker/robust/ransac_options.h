#pragma once

#include <atomic>
#include <cstdint>

namespace mono_pose_tracker {

/// Random sample consensus (Fischler and Bolles 1981) with MSAC scores and local optimisation.
struct RansacOptions {
  double threshold =
      0.003;  // largest error of an inlier: radians for the estimators on bearings, in (0, 0.5]
  double confidence = 0.9999;  // probability that the best model was sampled at least once, in (0, 1)
  int min_iterations = 50;     // at least 0
  int max_iterations = 5000;   // at least 1 and min_iterations
  std::uint64_t seed = 0;
  /// Set by another thread: the search ends with the best so far, after one sample at least. Null: never.
  const std::atomic<bool>* cancelled = nullptr;

  /// Throws std::invalid_argument that names the option, its value and its range.
  void validate() const;
};

}  // namespace mono_pose_tracker
