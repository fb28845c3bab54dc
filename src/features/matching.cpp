#include "mono_pose_tracker/features/matching.h"

#include <cmath>

#include "mono_pose_tracker/common/function_clones.h"

namespace mono_pose_tracker {

namespace {

// The 16-bit differences let the compiler use multiply-add pairs; the clones are chosen when the program is
// loaded.
MPT_FUNCTION_CLONES int distance2_128(const std::uint8_t* a, const std::uint8_t* b) {
  int sum = 0;
  for (int i = 0; i < 128; ++i) {
    const std::int16_t d = static_cast<std::int16_t>(a[i] - b[i]);
    sum += static_cast<int>(d) * d;
  }
  return sum;
}

// One row against many in one call: the clone's dispatch is paid once.
MPT_FUNCTION_CLONES void distances2_128(const std::uint8_t* a, const std::uint8_t* rows, std::size_t step,
                                        int count, int* out) {
  for (int r = 0; r < count; ++r) {
    const std::uint8_t* b = rows + r * step;
    int sum = 0;
    for (int i = 0; i < 128; ++i) {
      const std::int16_t d = static_cast<std::int16_t>(a[i] - b[i]);
      sum += static_cast<int>(d) * d;
    }
    out[r] = sum;
  }
}

}  // namespace

int descriptor_distance2(const std::uint8_t* a, const std::uint8_t* b) { return distance2_128(a, b); }

std::vector<Match> match_descriptors(const cv::Mat& first, const cv::Mat& second,
                                     const MatchOptions& options) {
  std::vector<Match> matches;
  if (first.rows == 0 || second.rows == 0) return matches;
  std::vector<NearestTwo> of_first(first.rows), of_second(second.rows);
  // Blocks of the second side that stay in the first-level cache.
  constexpr int kBlock = 128;
  std::vector<int> distances(kBlock);
  for (int start = 0; start < second.rows; start += kBlock) {
    if (is_set(options.cancelled)) return matches;
    const int count = std::min(kBlock, second.rows - start);
    for (int i = 0; i < first.rows; ++i) {
      distances2_128(first.ptr<std::uint8_t>(i), second.ptr<std::uint8_t>(start), second.step, count,
                     distances.data());
      for (int j = 0; j < count; ++j) {
        of_first[i].offer(start + j, distances[j]);
        of_second[start + j].offer(i, distances[j]);
      }
    }
  }
  const double max_ratio2 = 1.0 / (options.min_ratio * options.min_ratio);
  for (int i = 0; i < first.rows; ++i) {
    const NearestTwo& n = of_first[i];
    if (n.index < 0 || n.best > options.max_distance2) continue;
    if (options.mutual && of_second[n.index].index != i) continue;
    if (n.second != std::numeric_limits<int>::max() && n.best > max_ratio2 * n.second) continue;
    const double ratio2 = n.second == std::numeric_limits<int>::max() || n.second == 0
                              ? 1.0
                              : static_cast<double>(n.best) / n.second;
    matches.push_back({i, n.index, n.best, static_cast<float>(std::sqrt(ratio2))});
  }
  return matches;
}

}  // namespace mono_pose_tracker
