#include "mono_pose_tracker/features/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/function_clones.h"
#include "descriptor_distances.h"

namespace mono_pose_tracker {

namespace {

// The nearest to each row of a block, of the rows that have been offered.
struct NearestOfBlock {
  static constexpr int kBlock = DescriptorDistances::kBlock;
  std::array<int, kBlock> index, best;

  NearestOfBlock() {
    index.fill(NearestTwo().index);
    best.fill(NearestTwo().best);
  }
};

// Without a branch, for all of a block at once.
MPT_FUNCTION_CLONES void offer_to_each(int candidate, const int* distances, NearestOfBlock* nearest) {
  for (int j = 0; j < NearestOfBlock::kBlock; ++j) {
    const int d = distances[j], best = nearest->best[j];
    nearest->index[j] = d < best ? candidate : nearest->index[j];
    nearest->best[j] = std::min(best, d);
  }
}

MPT_FUNCTION_CLONES int least_of(const int* distances, int count) {
  int least = std::numeric_limits<int>::max();
  for (int j = 0; j < count; ++j) least = std::min(least, distances[j]);
  return least;
}

// Most blocks hold nothing nearer than the second nearest so far.
void offer_all(int begin, const int* distances, int count, NearestTwo* nearest) {
  if (least_of(distances, count) >= nearest->second) return;
  for (int j = 0; j < count; ++j) nearest->offer(begin + j, distances[j]);
}

}  // namespace

int descriptor_distance2(const std::uint8_t* a, const std::uint8_t* b) {
  int distance2;
  distances2_to_rows(a, b, 0, 1, &distance2);
  return distance2;
}

std::vector<Match> turned_round(std::vector<Match> matches) {
  for (Match& m : matches) std::swap(m.first, m.second);
  return matches;
}

std::vector<Match> match_descriptors(const cv::Mat& first, const cv::Mat& second,
                                     const MatchOptions& options) {
  std::vector<Match> matches;
  if (first.rows == 0 || second.rows == 0) return matches;
  std::vector<NearestTwo> of_first(first.rows);
  std::vector<int> of_second(second.rows);  // the nearest
  constexpr int kBlock = DescriptorDistances::kBlock, kRows = DescriptorDistances::kRows;
  DescriptorDistances distances(first, second);
  std::array<int, kBlock * kRows> found{};
  for (int begin = 0; begin < second.rows; begin += kBlock) {
    if (is_set(options.cancelled)) return matches;
    const int count = distances.take_block(begin);
    NearestOfBlock of_block;
    for (int i = 0; i < first.rows; i += kRows) {
      distances.find(i, found.data());
      for (int r = 0; r < std::min(kRows, first.rows - i); ++r) {
        offer_all(begin, &found[kBlock * r], count, &of_first[i + r]);
        offer_to_each(i + r, &found[kBlock * r], &of_block);
      }
    }
    std::copy_n(of_block.index.begin(), count, of_second.begin() + begin);
  }
  const double max_ratio2 = 1.0 / (options.min_ratio * options.min_ratio);
  for (int i = 0; i < first.rows; ++i) {
    const NearestTwo& n = of_first[i];
    if (n.index < 0) continue;
    if (options.mutual && of_second[n.index] != i) continue;
    if (n.second != std::numeric_limits<int>::max() && n.best > max_ratio2 * n.second) continue;
    const double ratio2 = n.second == std::numeric_limits<int>::max() || n.second == 0
                              ? 1.0
                              : static_cast<double>(n.best) / n.second;
    matches.push_back({i, n.index, n.best, static_cast<float>(std::sqrt(ratio2))});
  }
  return matches;
}

}  // namespace mono_pose_tracker
