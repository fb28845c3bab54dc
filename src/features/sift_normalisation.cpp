#include "sift_normalisation.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {
namespace {

constexpr float kByteScale = 512.0f;  // entries of a unit 128-vector are rarely above 0.5

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::min(255.0f, kByteScale * value + 0.5f));
}

}  // namespace

void quantise_descriptor(const float* histogram, bool root_sift, std::uint8_t* descriptor) {
  float sum = 0;
  float squared_sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    sum += histogram[i];
    squared_sum += histogram[i] * histogram[i];
  }
  if (sum <= 0) {
    std::fill_n(descriptor, kDescriptorSize, std::uint8_t{0});
    return;
  }
  const float scale = root_sift ? 1.0f / sum : 1.0f / std::sqrt(squared_sum);
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float value = histogram[i] * scale;
    descriptor[i] = to_byte(root_sift ? std::sqrt(value) : value);
  }
}

}  // namespace mono_pose_tracker
