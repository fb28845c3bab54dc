#include "robust/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace mono_pose_tracker {

namespace {

// Rejection: samples are far smaller than the data, or the data so few that it hardly matters.
void draw_distinct(Random* random, int num_data, int count, int* sample) {
  for (int i = 0; i < count; ++i) {
    do {
      sample[i] = static_cast<int>(random->index(static_cast<std::uint32_t>(num_data)));
    } while (std::find(sample, sample + i, sample[i]) != sample + i);
  }
}

void require_enough(std::size_t num_data, int sample_size) {
  if (sample_size < 1 || num_data < static_cast<std::size_t>(sample_size)) {
    throw std::invalid_argument("sampler: sample_size must be at least 1 and at most the number of data");
  }
}

}  // namespace

double ransac_iterations_needed(int num_inliers, int num_data, int sample_size, double confidence) {
  if (num_inliers < sample_size) return std::numeric_limits<double>::infinity();
  double good_sample = 1;
  for (int i = 0; i < sample_size; ++i) good_sample *= static_cast<double>(num_inliers - i) / (num_data - i);
  return good_sample < confidence ? std::log1p(-confidence) / std::log1p(-good_sample) : 1;
}

UniformSampler::UniformSampler(int num_data, int sample_size)
    : num_data_(num_data), sample_size_(sample_size) {
  require_enough(num_data < 0 ? 0 : num_data, sample_size);
}

void UniformSampler::draw(Random* random, int* sample) {
  draw_distinct(random, num_data_, sample_size_, sample);
}

ProsacSampler::ProsacSampler(const std::vector<float>& quality, int sample_size, double uniform_after)
    : order_(quality.size()),
      sample_size_(sample_size),
      subset_size_(sample_size),
      expected_draws_(uniform_after) {
  require_enough(quality.size(), sample_size);
  const auto rank = [&](int i) {
    return std::isnan(quality[i]) ? std::numeric_limits<float>::infinity() : quality[i];
  };
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return rank(a) < rank(b); });
  for (int i = 0; i < sample_size; ++i) {
    expected_draws_ *= static_cast<double>(sample_size - i) / (static_cast<double>(quality.size()) - i);
  }
}

void ProsacSampler::grow() {
  const double n = subset_size_;
  const double next = expected_draws_ * (n + 1) / (n + 1 - sample_size_);
  growth_at_ += static_cast<long long>(std::ceil(next - expected_draws_));
  expected_draws_ = next;
  ++subset_size_;
}

void ProsacSampler::draw(Random* random, int* sample) {
  ++draws_;
  const int num_data = static_cast<int>(order_.size());
  while (subset_size_ < num_data && draws_ > growth_at_) {
    grow();
  }
  if (draws_ > growth_at_) {  // the subset has become all data
    draw_distinct(random, num_data, sample_size_, sample);
  } else {  // the newest datum of the subset, with others of the subset
    draw_distinct(random, subset_size_ - 1, sample_size_ - 1, sample);
    sample[sample_size_ - 1] = subset_size_ - 1;
  }
  for (int i = 0; i < sample_size_; ++i) {
    sample[i] = order_[sample[i]];
  }
}

}  // namespace mono_pose_tracker
