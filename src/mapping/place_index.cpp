#include "mapping/place_index.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/statistics.h"
#include "common/toolchain.h"

namespace mono_pose_tracker {

namespace {

// Orientation of a feature in 256 steps, stored with its keyframe's number.
constexpr int kTurnBits = 8;
constexpr std::uint32_t kTurnMask = (1 << kTurnBits) - 1;

// The lists of this number of following features are prefetched while the present one votes, with this number
// of cache lines each; the processor prefetches the rest.
constexpr std::size_t kFeaturesAhead = 4;
constexpr int kLinesAhead = 16;

std::uint32_t turn_of(const Feature& feature) {
  const double turns = feature.angle / (2 * M_PI);
  return static_cast<std::uint32_t>((1 << kTurnBits) * (turns - std::floor(turns))) & kTurnMask;
}

/// The code's own word, then those one uncertain bit away.
std::uint16_t probed_word(const DescriptorCode& code, int probe) {
  return probe == 0 ? code.word : code.word ^ (1u << code.uncertain[probe - 1]);
}

}  // namespace

/// Votes of an image's features. Features common to two images are rotated by the same angle, accidental ones
/// by any (weak geometric consistency, Jegou, Douze and Schmid, ECCV 2008): votes are counted by rotation in
/// eighths, and the best two adjacent ones of a keyframe count. A feature votes once for a keyframe and
/// rotation, however many similar features it has.
class PlaceIndex::Votes {
 public:
  Votes(std::size_t num_slots, int num_keyframes, int max_distance)
      : of_turn_(num_slots * kTurns), num_keyframes_(num_keyframes), max_distance_(max_distance) {}

  NearFeature* room_for(std::size_t count) {
    if (near_.size() < count) near_.resize(2 * count);
    return near_.data();
  }
  /// Adds a match with rotation `turn`.
  void count(int found, std::uint32_t turn) {
    for (int i = 0; i < found; ++i) {
      const std::uint32_t between = (near_[i].owner - turn) & kTurnMask;
      const std::uint32_t bin =
          (near_[i].owner >> kTurnBits) * kTurns + (between >> (kTurnBits - kTurnsLog2));
      float& weight = of_turn_[bin].weight;
      if (weight == 0) voted_for_.push_back(bin);
      weight = std::max(weight, weight_of(near_[i].distance));
    }
  }
  /// Weights the votes of a feature: one that matches every keyframe is the least informative, one that
  /// matches a single keyframe the most.
  void end_feature() {
    const float rarity = rarity_of(std::max<std::size_t>(1, voted_for_.size()));
    most_ += rarity;
    for (const std::uint32_t bin : voted_for_) {
      of_turn_[bin].score += of_turn_[bin].weight * rarity;
      of_turn_[bin].weight = 0;
    }
    voted_for_.clear();
  }
  /// Score in [0, 1]; 1 where every feature was matched. `share`: the keyframe's number of features over the
  /// image's. The geometric mean of both numbers normalises the score, as a keyframe with many features has
  /// more accidental matches.
  double score(std::uint32_t slot, double share) const {
    const OfTurn* turns = &of_turn_[static_cast<std::size_t>(slot) * kTurns];
    float best = 0;
    for (int i = 0; i < kTurns; ++i) best = std::max(best, turns[i].score + turns[(i + 1) % kTurns].score);
    return best > 0 ? std::min(1.0, best / (most_ * std::sqrt(share))) : 0;
  }

 private:
  static constexpr int kTurnsLog2 = 3, kTurns = 1 << kTurnsLog2;

  // 1 for equal signatures, decreasing to nearly 0 at the largest distance that counts.
  float weight_of(int distance) const { return 1 - static_cast<float>(distance) / (max_distance_ + 1); }
  float rarity_of(std::size_t places) const {
    return std::log1p(static_cast<float>(num_keyframes_) / static_cast<float>(places));
  }

  struct OfTurn {
    float score = 0;
    float weight = 0;  // of the present feature's vote
  };

  std::vector<OfTurn> of_turn_;  // [slot][turn]
  std::vector<std::uint32_t> voted_for_;
  std::vector<NearFeature> near_;
  int num_keyframes_, max_distance_;
  float most_ = 0;
};

PlaceIndex::PlaceIndex(const PlaceIndexOptions& options)
    : options_(options), features_of_word_(1u << DescriptorCode::kWordBits) {}

std::vector<int> PlaceIndex::strongest(const FeatureSet& features) const {
  std::vector<int> order(features.size());
  std::iota(order.begin(), order.end(), 0);
  if (features.size() <= options_.max_features) return order;
  const auto is_stronger = [&](int a, int b) {
    const float of_a = features.features[a].response, of_b = features.features[b].response;
    return of_a != of_b ? of_a > of_b : a < b;
  };
  std::nth_element(order.begin(), order.begin() + options_.max_features, order.end(), is_stronger);
  order.resize(options_.max_features);
  std::sort(order.begin(), order.end(), is_stronger);
  return order;
}

std::vector<DescriptorCode> PlaceIndex::codes_of(const FeatureSet& features, const std::vector<int>& which,
                                                 int num_uncertain) const {
  std::vector<const std::uint8_t*> descriptors;
  descriptors.reserve(which.size());
  for (const int i : which) descriptors.push_back(features.descriptor(i));
  return coder_.encode(descriptors, num_uncertain);
}

void PlaceIndex::add(KeyframeId id, const FeatureSet& features) {
  if (contains(id)) throw std::invalid_argument("keyframe " + std::to_string(id) + " is already indexed");
  std::uint32_t number = static_cast<std::uint32_t>(slots_.size());
  if (free_slots_.empty()) {
    slots_.emplace_back();
  } else {
    number = free_slots_.back();
    free_slots_.pop_back();
  }
  slot_of_[id] = number;
  Slot& slot = slots_[number];
  slot.id = id;
  const std::vector<int> order = strongest(features);
  const std::vector<DescriptorCode> codes = codes_of(features, order, 0);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const DescriptorCode& code = codes[k];
    slot.words.push_back(code.word);
    features_of_word_[code.word].push_back({number << kTurnBits | turn_of(features.features[order[k]]),
                                            static_cast<std::uint32_t>(code.signature),
                                            static_cast<std::uint32_t>(code.signature >> 32)});
  }
}

void PlaceIndex::remove(KeyframeId id) {
  const auto found = slot_of_.find(id);
  if (found == slot_of_.end()) return;
  const std::uint32_t number = found->second;
  for (const std::uint16_t word : slots_[number].words) {
    std::vector<CodedFeature>& list = features_of_word_[word];
    list.erase(
        std::remove_if(list.begin(), list.end(),
                       [&](const CodedFeature& feature) { return feature.owner >> kTurnBits == number; }),
        list.end());
    // In a capped map keyframes come and go, and finally every word has had a feature.
    if (2 * list.size() < list.capacity()) list.shrink_to_fit();
  }
  slots_[number] = {};
  free_slots_.push_back(number);
  slot_of_.erase(found);
}

void PlaceIndex::clear() {
  for (auto& list : features_of_word_) list.clear();
  slots_.clear();
  free_slots_.clear();
  slot_of_.clear();
}

std::size_t PlaceIndex::memory_bytes() const {
  std::size_t bytes = features_of_word_.size() * sizeof(std::vector<CodedFeature>);
  for (const auto& list : features_of_word_) bytes += list.capacity() * sizeof(CodedFeature);
  for (const Slot& slot : slots_) bytes += sizeof slot + slot.words.capacity() * sizeof(std::uint16_t);
  return bytes;
}

// Prefetches the lists of a feature's words: memory latency is most of a query's time.
void PlaceIndex::fetch_lists(const DescriptorCode& code) const {
  for (int probe = 0; probe < options_.probes; ++probe) {
    const std::vector<CodedFeature>& list = features_of_word_[probed_word(code, probe)];
    const int lines = static_cast<int>((list.size() * sizeof(CodedFeature) + 63) / 64);
    for (int line = 0; line < std::min(lines, kLinesAhead); ++line) {
      __builtin_prefetch(reinterpret_cast<const char*>(list.data()) + 64 * line);
    }
  }
}

void PlaceIndex::vote(const DescriptorCode& code, std::uint32_t turn, Votes* votes) const {
  for (int probe = 0; probe < options_.probes; ++probe) {
    const std::vector<CodedFeature>& list = features_of_word_[probed_word(code, probe)];
    if (list.empty()) continue;
    votes->count(find_near(list.data(), static_cast<int>(list.size()), code.signature,
                           options_.max_signature_distance, votes->room_for(list.size())),
                 turn);
  }
  votes->end_feature();
}

std::vector<PlaceMatch> PlaceIndex::query(const FeatureSet& features, int count,
                                          const std::function<bool(KeyframeId)>& allowed) const {
  Votes votes(slots_.size(), size(), options_.max_signature_distance);
  const std::vector<int> voters = strongest(features);
  const std::vector<DescriptorCode> codes = codes_of(features, voters, options_.probes - 1);
  for (std::size_t k = 0; k < codes.size(); ++k) {
    if (k + kFeaturesAhead < codes.size()) fetch_lists(codes[k + kFeaturesAhead]);
    vote(codes[k], turn_of(features.features[voters[k]]), &votes);
  }
  std::vector<PlaceMatch> ranked;
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    const double score = votes.score(i, static_cast<double>(slots_[i].words.size()) / voters.size());
    if (score > 0) ranked.push_back({slots_[i].id, score});
  }
  std::sort(ranked.begin(), ranked.end(), [](const PlaceMatch& a, const PlaceMatch& b) {
    return a.score != b.score ? a.score > b.score : a.id < b.id;
  });
  std::vector<PlaceMatch> best;
  for (const PlaceMatch& match : ranked) {
    if (static_cast<int>(best.size()) >= count) break;
    if (!allowed || allowed(match.id)) best.push_back(match);
  }
  return best;
}

std::vector<KeyframeId> KeyframePlaces::find(const FeatureSet& features, int count) const {
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  std::vector<KeyframeId> ids;
  for (const PlaceMatch& match : index_.query(features, count)) ids.push_back(match.id);
  return ids;
}

void KeyframePlaces::reset(const Map& map) {
  {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.clear();
    known_.clear();
  }
  follow(map);
}

// Keyframe ids grow with time. The newest ids and the number of keyframes show what has changed; all
// keyframes are visited only when one was removed.
void KeyframePlaces::follow(const Map& map) {
  const auto& keyframes = map.keyframes();
  auto is_new = keyframes.rbegin();
  while (is_new != keyframes.rend() && (known_.empty() || is_new->first > known_.back())) ++is_new;
  for (auto added = is_new.base(); added != keyframes.end(); ++added) {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.add(added->first, added->second.image->set);
    known_.push_back(added->first);
  }
  if (known_.size() == keyframes.size()) return;
  const auto is_gone = [&](KeyframeId id) {
    if (map.keyframe(id)) return false;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    index_.remove(id);
    return true;
  };
  known_.erase(std::remove_if(known_.begin(), known_.end(), is_gone), known_.end());
}

namespace {

// Mean of 36,000 root-SIFT descriptors of images that simulate_sequence rendered (--scene room --noise 2). It
// is subtracted before descriptors are compared by sign, as common components do not discriminate. The mean
// hardly depends on the scene (more at the centre, more along the main direction). It is not learnt from the
// recording, so codes never change.
constexpr std::array<int, 128> kDescriptorMean = {
    // clang-format off
    37, 27, 23, 26, 32, 32, 34, 36,
    54, 39, 28, 27, 29, 30, 35, 44,
    53, 44, 35, 32, 31, 27, 27, 37,
    35, 35, 33, 34, 35, 28, 23, 26,
    45, 31, 27, 33, 41, 38, 35, 37,
    76, 48, 31, 33, 37, 36, 36, 51,
    75, 51, 37, 39, 40, 33, 30, 46,
    43, 36, 35, 39, 43, 34, 26, 29,
    45, 38, 36, 39, 40, 32, 26, 30,
    76, 51, 36, 37, 38, 32, 30, 47,
    74, 46, 30, 32, 40, 39, 36, 50,
    43, 29, 26, 33, 42, 40, 35, 36,
    36, 36, 34, 33, 33, 27, 23, 27,
    54, 45, 34, 30, 30, 27, 27, 38,
    52, 38, 28, 27, 32, 32, 34, 43,
    34, 26, 24, 28, 34, 33, 32, 34,
    // clang-format on
};

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

DescriptorCoder::DescriptorCoder() {
  Random random(0);
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
