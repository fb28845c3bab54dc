#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <shared_mutex>
#include <unordered_map>
#include <vector>

#include "map/tracking_map.h"
#include "mono_pose_tracker/map/map.h"

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
  DescriptorCoder();

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

struct PlaceIndexOptions {
  int max_features = 800;  // of an image, at least 1, the strongest: more find no other places and cost time
  int probes = 4;  // words looked up for a feature, 1 to 17: its own, and those one uncertain bit away
  // Bits of 64 in which the signatures of a match differ at most, 0 to 31. Unrelated ones differ in 32
  // (deviation 4): four deviations below, one in 30,000 passes by chance. Views of one point differ in about
  // a dozen.
  int max_signature_distance = 16;
};

/// A keyframe that looks like an image.
struct PlaceMatch {
  KeyframeId id = -1;
  // In [0, 1]: share of the features that the two have in common, each counted by how near and how rare it
  // is.
  double score = 0;
};

/// Finds the keyframes that look like an image, among thousands, by descriptors alone. An inverted index over
/// binary codes: words as in a visual vocabulary (Sivic and Zisserman, ICCV 2003), signatures that reject
/// features which only share a word, and votes for a common image rotation (Jegou, Douze and Schmid, ECCV
/// 2008). Nothing is trained, so the cost of a keyframe is constant. The result depends only on the set of
/// keyframes, not on their order or on removed ones; an index rebuilt from a loaded map gives equal results.
///
/// One writer: add, remove and clear must not run concurrently with another call. Queries may run
/// concurrently.
class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceIndexOptions& options = {});

  /// Throws std::invalid_argument when the keyframe is there already.
  void add(KeyframeId id, const FeatureSet& features);
  /// Nothing happens when it is not there.
  void remove(KeyframeId id);
  void clear();

  bool contains(KeyframeId id) const { return slot_of_.count(id) > 0; }
  int size() const { return static_cast<int>(slot_of_.size()); }
  std::size_t memory_bytes() const;

  /// The keyframes with a score above 0 that are allowed (empty: all), `count` at most, best first; of
  /// equals, the older first. `allowed` is asked once or never for a keyframe.
  std::vector<PlaceMatch> query(const FeatureSet& features, int count,
                                const std::function<bool(KeyframeId)>& allowed = {}) const;

 private:
  // Keyframes are numbered densely; a number is given again when its keyframe is gone.
  struct Slot {
    KeyframeId id = -1;
    std::vector<std::uint16_t> words;  // of its features
  };
  class Votes;

  std::vector<int> strongest(const FeatureSet& features) const;
  std::vector<DescriptorCode> codes_of(const FeatureSet& features, const std::vector<int>& which,
                                       int num_uncertain) const;
  void fetch_lists(const DescriptorCode& code) const;
  void vote(const DescriptorCode& code, std::uint32_t turn, Votes* votes) const;

  PlaceIndexOptions options_;
  DescriptorCoder coder_;
  std::vector<std::vector<CodedFeature>> features_of_word_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_slots_;
  std::unordered_map<KeyframeId, std::uint32_t> slot_of_;
};

// The place index of a map. The mapper keeps it up to date; any thread with a snapshot may query it.
class KeyframePlaces : public PlaceFinder {
 public:
  std::vector<KeyframeId> find(const FeatureSet& features, int count) const override;

  // Adds new keyframes to the index and drops removed ones.
  void follow(const Map& map);
  // Makes the index anew, of a map that is not the followed one at a later time.
  void reset(const Map& map);
  // Only for the mapper's thread.
  const PlaceIndex& index() const { return index_; }

 private:
  mutable std::shared_mutex mutex_;  // guards index_; the mapper alone changes it
  PlaceIndex index_;
  std::vector<KeyframeId> known_;  // the mapper's; ascending
};

}  // namespace mono_pose_tracker
