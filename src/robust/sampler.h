#pragma once

#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {

/// Samples of distinct data after which one without outliers was drawn with the given probability (the chance
/// of each is hypergeometric); infinite when there are fewer inliers than a sample has. num_data >=
/// sample_size.
double ransac_iterations_needed(int num_inliers, int num_data, int sample_size, double confidence);

/// Samples of distinct data, every set equally likely.
class UniformSampler {
 public:
  /// num_data >= sample_size >= 1.
  UniformSampler(int num_data, int sample_size);

  /// Writes sample_size distinct indices below num_data.
  void draw(Random* random, int* sample);

 private:
  int num_data_;
  int sample_size_;
};

/// Samples from a growing set of the best data first, and finally as UniformSampler: PROSAC
/// (Chum and Matas, "Matching with PROSAC", CVPR 2005). The paper also stops once enough of the best data
/// agree. This shows that no other model has more of the best data, not of all data: a smaller motion whose
/// data rank better would be chosen. Here the inlier ratio of all data decides.
class ProsacSampler {
 public:
  /// quality: one value a datum, smaller is better, not a number counts as worst; at least sample_size of
  /// them. uniform_after: draws after which it is plain random sampling (T_N of the paper).
  ProsacSampler(const std::vector<float>& quality, int sample_size, double uniform_after = 200000);

  void draw(Random* random, int* sample);

  /// How many of the best data the last sample was drawn from.
  int subset_size() const { return subset_size_; }

 private:
  void grow();

  std::vector<int> order_;  // best first
  int sample_size_;
  int subset_size_;          // n
  long long draws_ = 0;      // t
  double expected_draws_;    // T_n: samples within the n best, of uniform_after drawn from all
  long long growth_at_ = 1;  // T'_n: the draw from which on the subset must be larger
};

}  // namespace mono_pose_tracker
