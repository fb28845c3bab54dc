#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace mono_pose_tracker {

/// What stands for a descriptor where thousands of images are searched: the signs of random projections.
struct DescriptorCode {
  static constexpr int kWordBits = 16;
  std::uint16_t word = 0;       // descriptors with the same word are compared at all
  std::uint64_t signature = 0;  // the more of its bits agree, the nearer they are
  std::array<std::uint8_t, kWordBits>
      uncertain{};  // the first `num_uncertain` bits of the word nearest to turning
};

/// Codes of SIFT descriptors by random hyperplanes (Charikar, STOC 2002) through their mean. Nothing is
/// trained, so the code of a descriptor never changes; whole numbers only, so it is the same on every
/// machine.
class DescriptorCoder {
 public:
  explicit DescriptorCoder(std::uint64_t seed);

  /// Of 128 bytes each. `num_uncertain`, at most kWordBits: how many uncertain bits are wanted, the least
  /// certain first.
  std::vector<DescriptorCode> encode(const std::vector<const std::uint8_t*>& descriptors,
                                     int num_uncertain) const;

  using Signs = std::array<std::array<std::int32_t, 128>, 3>;

 private:
  Signs signs_;  // of the random rotation, +1 or -1
};

/// A feature in the list of its word; the signature in halves, so that it takes 12 bytes.
struct CodedFeature {
  std::uint32_t owner, signature_low, signature_high;
};

struct NearFeature {
  std::uint32_t owner;
  int distance;  // bits in which the signatures differ
};

/// Those of `count` features whose signatures differ in max_distance bits at most, in their order; `near` has
/// room for all. Returns how many there are.
int find_near(const CodedFeature* features, int count, std::uint64_t signature, int max_distance,
              NearFeature* near);

}  // namespace mono_pose_tracker
