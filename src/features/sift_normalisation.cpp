#include "sift_normalisation.h"

#include <algorithm>
#include <cmath>

#include "common/function_clones.h"
#include "sift_vector.h"

namespace mono_pose_tracker {
namespace {

constexpr float kByteScale = 512.0f;  // entries of a unit 128-vector are rarely above 0.5

MPT_FUNCTION_CLONES
void to_bytes(const float* histogram, float scale, bool root, std::uint8_t* __restrict bytes) {
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float value = histogram[i] * scale;
    const float entry = kByteScale * (root ? std::sqrt(value) : value) + 0.5f;
    bytes[i] = static_cast<std::uint8_t>(static_cast<int>(entry < 255.0f ? entry : 255.0f));
  }
}

MPT_FUNCTION_CLONES
float sum_of(const float* histogram) {
  Floats8 sum = {};
  for (int i = 0; i < kDescriptorSize; i += 8) sum += MPT_SIFT_LOAD(histogram + i);
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

MPT_FUNCTION_CLONES
float sum_of_squares(const float* histogram) {
  Floats8 sum = {};
  for (int i = 0; i < kDescriptorSize; i += 8) {
    const Floats8 entries = MPT_SIFT_LOAD(histogram + i);
    sum += entries * entries;
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

MPT_FUNCTION_CLONES
void scale_and_limit(float scale, float limit, float* histogram) {
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float entry = histogram[i] * scale;
    histogram[i] = entry < limit ? entry : limit;
  }
}

float inverse_length(const float* histogram) {
  const float squared = sum_of_squares(histogram);
  return squared > 0 ? 1.0f / std::sqrt(squared) : 0.0f;
}

}  // namespace

void limit_entries(float largest_entry, float* histogram) {
  scale_and_limit(inverse_length(histogram), largest_entry, histogram);
  scale_and_limit(inverse_length(histogram), 1.0f, histogram);
}

void quantise_descriptor(const float* histogram, bool root_sift, std::uint8_t* descriptor) {
  const float sum = sum_of(histogram);
  if (sum <= 0) {
    std::fill_n(descriptor, kDescriptorSize, std::uint8_t{0});
    return;
  }
  const float scale = root_sift ? 1.0f / sum : 1.0f / std::sqrt(sum_of_squares(histogram));
  to_bytes(histogram, scale, root_sift, descriptor);
}

}  // namespace mono_pose_tracker
