#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace mono_pose_tracker {

/// Binary code of a descriptor for the search among thousands of images: the signs of random projections.
struct DescriptorCode {
  static constexpr int kWordBits = 16;
  std::uint16_t word = 0;       // only descriptors with the same word are compared
  std::uint64_t signature = 0;  // its Hamming distance approximates the angle between descriptors
  std::array<std::uint8_t, kWordBits>
      uncertain{};  // the first `num_uncertain`: bits of the word nearest to a change of sign
};

/// Codes of SIFT descriptors by random hyperplanes (Charikar, STOC 2002) through their mean. Nothing is
/// trained, so the code of a descriptor never changes. Integer arithmetic makes it the same on every machine.
class DescriptorCoder {
 public:
  explicit DescriptorCoder(std::uint64_t seed);

  /// Descriptors have 128 bytes each. `num_uncertain`, at most kWordBits: number of uncertain bits to return,
  /// the least certain first.
  std::vector<DescriptorCode> encode(const std::vector<const std::uint8_t*>& descriptors,
                                     int num_uncertain) const;

  using Signs = std::array<std::array<std::int32_t, 128>, 3>;

 private:
  Signs signs_;  // of the random rotation, +1 or -1
};

/// A feature in the list of its word. The signature is stored in two halves, so that the struct takes 12
/// bytes.
struct CodedFeature {
  std::uint32_t owner, signature_low, signature_high;
};

struct NearFeature {
  std::uint32_t owner;
  int distance;  // bits in which the signatures differ
};

/// Finds those of `count` features whose signatures differ in at most max_distance bits, in their order.
/// `near` has room for all of them. Returns their number.
int find_near(const CodedFeature* features, int count, std::uint64_t signature, int max_distance,
              NearFeature* near);

}  // namespace mono_pose_tracker
