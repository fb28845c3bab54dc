#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "robust/ransac.h"
#include "robust/sampler.h"

namespace mono_pose_tracker {

// Throws std::invalid_argument. options: the name of those that hold the quality; data: what it is of.
inline void require_quality_of_each(const std::vector<float>& quality, std::size_t count, const char* options,
                                    const char* data) {
  if (quality.empty() || quality.size() == count) return;
  throw std::invalid_argument(std::string(options) + ": quality has " + std::to_string(quality.size()) +
                              " values for " + std::to_string(count) + " " + data);
}

// Samples the best data first if their quality is known. quality: of the vectors from which `data` was made;
// source(i) is the index of datum i in them. Empty: not known.
template <class Data, class Estimator>
RansacReport<typename Estimator::Model> sample_consensus(const RansacOptions& options, const Data& data,
                                                         const std::vector<float>& quality,
                                                         Estimator& estimator, int num_alternatives = 0) {
  if (quality.empty()) {
    UniformSampler sampler(data.size(), Estimator::kSampleSize);
    return ransac(options, estimator, sampler, num_alternatives);
  }
  std::vector<float> of_data(data.size());
  for (int i = 0; i < data.size(); ++i) {
    of_data[i] = quality[data.source(i)];
  }
  ProsacSampler sampler(of_data, Estimator::kSampleSize);
  return ransac(options, estimator, sampler, num_alternatives);
}

}  // namespace mono_pose_tracker
