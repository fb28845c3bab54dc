#include "mapping/place_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

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

void check_range(const char* key, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(std::string(key) + " is " + std::to_string(value) + ", expected " +
                              std::to_string(low) + " to " + std::to_string(high));
}

}  // namespace

void PlaceIndexOptions::validate() const {
  check_range("max_features", max_features, 1, 1000000);
  check_range("probes", probes, 1, 1 + DescriptorCode::kWordBits);
  check_range("max_signature_distance", max_signature_distance, 0, 31);
}

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
    : options_(options), coder_(options.seed), features_of_word_(1u << DescriptorCode::kWordBits) {
  options_.validate();
}

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

}  // namespace mono_pose_tracker
