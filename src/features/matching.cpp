#include "mono_pose_tracker/features/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/toolchain.h"
#include "descriptor_distances.h"
#include "mono_pose_tracker/features/feature_grid.h"
#include "sift_descriptor.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define MPT_HAS_DOT_PRODUCTS 1
#endif

namespace mono_pose_tracker {

FeatureGrid::FeatureGrid(const FeatureSet& features, int width, int height, int cell_px)
    : cell_px_(cell_px),
      cells_x_((width + cell_px - 1) / cell_px),
      cells_y_((height + cell_px - 1) / cell_px) {
  const int n = features.size();
  std::vector<int> cell_of(n);
  begin_.assign(cells_x_ * cells_y_ + 1, 0);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2f& p = features.features[i].pixel;
    cell_of[i] = cell(p.y(), cells_y_) * cells_x_ + cell(p.x(), cells_x_);
    ++begin_[cell_of[i] + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  index_.resize(n);
  pixels_.resize(n);
  for (int i = 0; i < n; ++i) {
    const int k = next[cell_of[i]]++;
    index_[k] = i;
    pixels_[k] = features.features[i].pixel;
  }
}

namespace {

constexpr int kPacketSize = 16;  // rows of a block that one instruction serves
constexpr int kGroup = kPacketSize * kDescriptorSize;

#ifdef MPT_HAS_DOT_PRODUCTS
#define MPT_DOT_PRODUCTS __attribute__((target("avx512f,avx512vnni")))

// Four bytes of a row, in all elements of the packet.
MPT_DOT_PRODUCTS __m512i broadcast_four(const std::int8_t* bytes) {
  int four;
  std::memcpy(&four, bytes, sizeof four);
  return _mm512_set1_epi32(four);
}

// Of four rows of a, one after the other, with the rows of a block's groups.
MPT_DOT_PRODUCTS void dot_products(const std::int8_t* a, const std::uint8_t* groups, int count, int* out) {
  static_assert(DescriptorDistances::kRows == 4);
  for (int g = 0; g < count; ++g) {
    __m512i s0 = _mm512_setzero_si512(), s1 = s0, s2 = s0, s3 = s0;
    for (int i = 0; i < kDescriptorSize; i += 4) {
      const __m512i b = _mm512_loadu_si512(groups + kGroup * g + kPacketSize * i);
      s0 = _mm512_dpbusd_epi32(s0, b, broadcast_four(a + i));
      s1 = _mm512_dpbusd_epi32(s1, b, broadcast_four(a + kDescriptorSize + i));
      s2 = _mm512_dpbusd_epi32(s2, b, broadcast_four(a + 2 * kDescriptorSize + i));
      s3 = _mm512_dpbusd_epi32(s3, b, broadcast_four(a + 3 * kDescriptorSize + i));
    }
    int* to = out + kPacketSize * g;
    _mm512_storeu_si512(to, s0);
    _mm512_storeu_si512(to + DescriptorDistances::kBlock, s1);
    _mm512_storeu_si512(to + 2 * DescriptorDistances::kBlock, s2);
    _mm512_storeu_si512(to + 3 * DescriptorDistances::kBlock, s3);
  }
}
#else
void dot_products(const std::int8_t*, const std::uint8_t*, int, int*) {}
#endif

MPT_FUNCTION_CLONES void to_distances(int of_row, const int* of_block, int count, int* dot_products) {
  for (int j = 0; j < count; ++j) {
    dot_products[j] = of_row + of_block[j] - 2 * dot_products[j];
  }
}

int rounded_up(int count, int step) { return (count + step - 1) / step * step; }

}  // namespace

// The 16-bit differences let the compiler use multiply-add pairs.
MPT_FUNCTION_CLONES void distances2_to_rows(const std::uint8_t* a, const std::uint8_t* rows, std::size_t step,
                                            int count, int* out) {
  for (int r = 0; r < count; ++r) {
    const std::uint8_t* b = rows + r * step;
    int sum = 0;
    for (int i = 0; i < kDescriptorSize; ++i) {
      const std::int16_t d = static_cast<std::int16_t>(a[i] - b[i]);
      sum += static_cast<int>(d) * d;
    }
    out[r] = sum;
  }
}

DescriptorDistances::Instructions DescriptorDistances::best_instructions() {
#ifdef MPT_HAS_DOT_PRODUCTS
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vnni")) {
    return Instructions::kDotProducts;
  }
#endif
  return Instructions::kAny;
}

DescriptorDistances::DescriptorDistances(const cv::Mat& first, const cv::Mat& second,
                                         Instructions instructions)
    : first_(first), second_(second), instructions_(std::min(instructions, best_instructions())) {
  if (instructions_ == Instructions::kDotProducts) pack_first();
}

void DescriptorDistances::pack_first() {
  const int rows = rounded_up(first_.rows, kRows);
  signed_first_.assign(static_cast<std::size_t>(rows) * kDescriptorSize, 0);
  first_terms_.assign(rows, 0);
  for (int i = 0; i < first_.rows; ++i) {
    const std::uint8_t* row = first_.ptr<std::uint8_t>(i);
    std::int8_t* to = &signed_first_[static_cast<std::size_t>(i) * kDescriptorSize];
    for (int k = 0; k < kDescriptorSize; ++k) {
      to[k] = static_cast<std::int8_t>(row[k] - 128);
      first_terms_[i] += row[k] * row[k];
    }
  }
  block_bytes_.assign(kBlock * kDescriptorSize, 0);
  block_terms_.assign(kBlock, 0);
}

int DescriptorDistances::take_block(int begin) {
  begin_ = begin;
  count_ = std::min(kBlock, second_.rows - begin);
  if (instructions_ == Instructions::kDotProducts) pack_block();
  return count_;
}

void DescriptorDistances::pack_block() {
  for (int j = 0; j < count_; ++j) {
    const std::uint8_t* row = second_.ptr<std::uint8_t>(begin_ + j);
    std::uint8_t* to = &block_bytes_[kGroup * (j / kPacketSize) + 4 * (j % kPacketSize)];
    int term = 0;
    for (int k = 0; k < kDescriptorSize; ++k) term += row[k] * (row[k] - 2 * 128);
    block_terms_[j] = term;
    for (int k = 0; k < kDescriptorSize; k += 4) std::memcpy(to + kPacketSize * k, row + k, 4);
  }
}

void DescriptorDistances::find(int row, int* result) const {
  if (instructions_ == Instructions::kDotProducts) {
    const int count = rounded_up(count_, kPacketSize);  // of a block that is not full no more is written
    dot_products(&signed_first_[static_cast<std::size_t>(row) * kDescriptorSize], block_bytes_.data(),
                 count / kPacketSize, result);
    for (int r = 0; r < kRows; ++r) {
      to_distances(first_terms_[row + r], block_terms_.data(), count, result + kBlock * r);
    }
    return;
  }
  for (int r = 0; r < std::min(kRows, first_.rows - row); ++r) {
    distances2_to_rows(first_.ptr<std::uint8_t>(row + r), second_.ptr<std::uint8_t>(begin_), second_.step,
                       count_, result + kBlock * r);
  }
}

namespace {

// The nearest to each row of a block, of the rows that have been offered.
struct NearestOfBlock {
  std::array<int, DescriptorDistances::kBlock> index, best;

  NearestOfBlock() {
    index.fill(NearestTwo().index);
    best.fill(NearestTwo().best);
  }
};

// Without a branch, for all of a block at once.
MPT_FUNCTION_CLONES void offer_to_each(int candidate, const int* distances, NearestOfBlock* nearest) {
  for (int j = 0; j < DescriptorDistances::kBlock; ++j) {
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
  DescriptorDistances distances(first, second);
  std::array<int, DescriptorDistances::kBlock * DescriptorDistances::kRows> found{};
  for (int begin = 0; begin < second.rows; begin += DescriptorDistances::kBlock) {
    if (is_set(options.cancelled)) return matches;
    const int count = distances.take_block(begin);
    NearestOfBlock of_block;
    for (int i = 0; i < first.rows; i += DescriptorDistances::kRows) {
      distances.find(i, found.data());
      for (int r = 0; r < std::min(DescriptorDistances::kRows, first.rows - i); ++r) {
        offer_all(begin, &found[DescriptorDistances::kBlock * r], count, &of_first[i + r]);
        offer_to_each(i + r, &found[DescriptorDistances::kBlock * r], &of_block);
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
