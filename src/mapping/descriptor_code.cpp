#include "mono_pose_tracker/mapping/descriptor_code.h"

#include <cstdlib>
#include <limits>

#include "descriptor_mean.h"
#include "mono_pose_tracker/common/function_clones.h"
#include "mono_pose_tracker/common/random.h"

namespace mono_pose_tracker {

namespace {

using Vector128 = std::array<std::int32_t, 128>;

// Unnormalised Walsh-Hadamard transform: each pair (x, y) at distance `half` becomes (x + y, x - y).
inline void hadamard(std::int32_t* v) {
  for (int half = 1; half < 128; half *= 2) {
    for (int start = 0; start < 128; start += 2 * half) {
      for (int i = start; i < start + half; ++i) {
        const std::int32_t x = v[i], y = v[i + half];
        v[i] = x + y;
        v[i + half] = x - y;
      }
    }
  }
}

// A random rotation in a few thousand additions: three rounds of random signs and a Hadamard transform
// (Andoni et al., NIPS 2015). Its values stay below 255 * 128^3 < 2^31. The clones are chosen when the
// program is loaded; whole numbers give the same in each.
MPT_FUNCTION_CLONES_FOR("avx2")
void rotate(const std::uint8_t* descriptor, const std::array<std::array<std::int32_t, 128>, 3>& signs,
            Vector128* out) {
  std::int32_t* v = out->data();
  for (int i = 0; i < 128; ++i) v[i] = descriptor[i] - kDescriptorMean[i];
  for (const auto& round : signs) {
    for (int i = 0; i < 128; ++i) v[i] *= round[i];
    hadamard(v);
  }
}

}  // namespace

DescriptorCoder::DescriptorCoder(std::uint64_t seed) {
  Random random(seed);
  for (auto& round : signs_) {
    for (std::int32_t& sign : round) sign = random.index(2) == 0 ? -1 : 1;
  }
}

DescriptorCode DescriptorCoder::encode(const std::uint8_t* descriptor, int num_uncertain) const {
  Vector128 projected;
  rotate(descriptor, signs_, &projected);
  DescriptorCode code;
  std::array<std::int32_t, DescriptorCode::kWordBits> margin;
  for (int i = 0; i < DescriptorCode::kWordBits; ++i) {
    code.word |= static_cast<std::uint16_t>(projected[i] > 0) << i;
    margin[i] = std::abs(projected[i]);
  }
  constexpr int kFirstOfSignature = 64;
  for (int i = 0; i < 64; ++i) {
    code.signature |= static_cast<std::uint64_t>(projected[kFirstOfSignature + i] > 0) << i;
  }
  for (int n = 0; n < num_uncertain; ++n) {
    int least = 0;
    for (int i = 1; i < DescriptorCode::kWordBits; ++i) {
      if (margin[i] < margin[least]) least = i;
    }
    code.uncertain[n] = static_cast<std::uint8_t>(least);
    margin[least] = std::numeric_limits<std::int32_t>::max();
  }
  return code;
}

MPT_FUNCTION_CLONES_FOR("popcnt")
int find_near(const CodedFeature* features, int count, std::uint64_t signature, int max_distance,
              NearFeature* near) {
  const auto low = static_cast<std::uint32_t>(signature);
  const auto high = static_cast<std::uint32_t>(signature >> 32);
  int found = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t differing = static_cast<std::uint64_t>(features[i].signature_high ^ high) << 32 |
                                    (features[i].signature_low ^ low);
    const int distance = __builtin_popcountll(differing);
    near[found] = {features[i].owner, distance};  // without a branch: few stay, none can be foreseen
    found += distance <= max_distance;
  }
  return found;
}

}  // namespace mono_pose_tracker
