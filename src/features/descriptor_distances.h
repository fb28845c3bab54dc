#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace mono_pose_tracker {

// Distances of one descriptor to `count` others, `step` bytes apart, with a single dispatch on the processor.
void distances2_to_rows(const std::uint8_t* a, const std::uint8_t* rows, std::size_t step, int count,
                        int* out);

// Squared distances between the rows of two sets of descriptors (N x 128, CV_8U), in blocks: a block of the
// second set that fits the first-level cache, against a few rows of the first. They are integers and do not
// depend on the processor's instructions.
class DescriptorDistances {
 public:
  static constexpr int kBlock = 128;  // rows of the second
  static constexpr int kRows = 4;     // of the first: what is loaded of a block serves all of them

  enum class Instructions { kAny, kDotProducts };  // AVX-512 VNNI
  static Instructions best_instructions();

  DescriptorDistances(const cv::Mat& first, const cv::Mat& second,
                      Instructions instructions = best_instructions());

  // The block is that of the rows from `begin` on; how many there are.
  int take_block(int begin);

  // Of the first's rows from `row` on to the block's: of row + r to its j-th in result[kBlock * r + j]. What
  // would belong to rows that are not there is left undefined.
  void find(int row, int* result) const;

 private:
  void pack_first();
  void pack_block();

  const cv::Mat first_, second_;
  const Instructions instructions_;
  int begin_ = 0, count_ = 0;

  // For dot products, |a - b|^2 = |a|^2 + |b|^2 - 2 a . b, which take one side with a sign: a - 128.
  std::vector<std::int8_t> signed_first_;
  std::vector<int> first_terms_;           // |a|^2
  std::vector<std::uint8_t> block_bytes_;  // of 16 rows four bytes each, then the next four
  std::vector<int> block_terms_;           // |b|^2 - 2 * 128 * (sum of b)
};

}  // namespace mono_pose_tracker
