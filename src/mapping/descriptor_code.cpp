#include "mapping/descriptor_code.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "common/statistics.h"
#include "common/toolchain.h"
#include "descriptor_mean.h"

namespace mono_pose_tracker {

namespace {

// Number of descriptors that are rotated at once, one in each element of a SIMD packet.
constexpr int kPacketSize = 8;
using Packet = std::array<std::int32_t, kPacketSize>;
using Rotated = std::array<Packet, 128>;

// Unnormalised Walsh-Hadamard transform: each pair (x, y) at distance `half` becomes (x + y, x - y).
inline void hadamard(Packet* v) {
  for (int half = 1; half < 128; half *= 2) {
    for (int start = 0; start < 128; start += 2 * half) {
      for (int i = start; i < start + half; ++i) {
        for (int slot = 0; slot < kPacketSize; ++slot) {
          const std::int32_t x = v[i][slot], y = v[i + half][slot];
          v[i][slot] = x + y;
          v[i + half][slot] = x - y;
        }
      }
    }
  }
}

// A random rotation in a few thousand additions: three rounds of random signs and a Hadamard transform
// (Andoni et al., NIPS 2015). Its values stay below 255 * 128^3 < 2^31. The function clone is chosen at load
// time; integer arithmetic gives the same result in each.
MPT_FUNCTION_CLONES_FOR("avx2")
void rotate(const std::array<const std::uint8_t*, kPacketSize>& descriptors,
            const DescriptorCoder::Signs& signs, Rotated* out) {
  Packet* v = out->data();
  for (int i = 0; i < 128; ++i) {
    for (int slot = 0; slot < kPacketSize; ++slot) v[i][slot] = descriptors[slot][i] - kDescriptorMean[i];
  }
  for (const auto& round : signs) {
    for (int i = 0; i < 128; ++i) {
      for (int slot = 0; slot < kPacketSize; ++slot) v[i][slot] *= round[i];
    }
    hadamard(v);
  }
}

DescriptorCode code_of(const Rotated& rotated, int slot, int num_uncertain) {
  DescriptorCode code;
  std::array<std::int32_t, DescriptorCode::kWordBits> margin;
  for (int i = 0; i < DescriptorCode::kWordBits; ++i) {
    code.word |= static_cast<std::uint16_t>(rotated[i][slot] > 0) << i;
    margin[i] = std::abs(rotated[i][slot]);
  }
  constexpr int kFirstOfSignature = 64;
  for (int i = 0; i < 64; ++i) {
    code.signature |= static_cast<std::uint64_t>(rotated[kFirstOfSignature + i][slot] > 0) << i;
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

}  // namespace

DescriptorCoder::DescriptorCoder(std::uint64_t seed) {
  Random random(seed);
  for (auto& round : signs_) {
    for (std::int32_t& sign : round) sign = random.index(2) == 0 ? -1 : 1;
  }
}

std::vector<DescriptorCode> DescriptorCoder::encode(const std::vector<const std::uint8_t*>& descriptors,
                                                    int num_uncertain) const {
  std::vector<DescriptorCode> codes;
  codes.reserve(descriptors.size());
  Rotated rotated;
  for (std::size_t begin = 0; begin < descriptors.size(); begin += kPacketSize) {
    const int count = static_cast<int>(std::min<std::size_t>(kPacketSize, descriptors.size() - begin));
    std::array<const std::uint8_t*, kPacketSize> packet;
    for (int slot = 0; slot < kPacketSize; ++slot)
      packet[slot] = descriptors[begin + std::min(slot, count - 1)];
    rotate(packet, signs_, &rotated);
    for (int slot = 0; slot < count; ++slot) codes.push_back(code_of(rotated, slot, num_uncertain));
  }
  return codes;
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
    near[found] = {features[i].owner, distance};  // branch-free: few features pass, unpredictably
    found += distance <= max_distance;
  }
  return found;
}

}  // namespace mono_pose_tracker
