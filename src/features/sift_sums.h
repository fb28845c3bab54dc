#pragma once

namespace mono_pose_tracker {

/// Sums for symmetric kernels: pair i of a kernel weights a sample i before with one i + shift behind.
/// Implemented for each vector width of the processors; results are equal except that from kAvx2 on product
/// and sum are rounded once (fused).
struct SiftSums {
  enum class Instructions { kAny, kAvx2, kAvx512 };

  /// The widest of this processor.
  static Instructions best_instructions();
  /// Those not above this processor's.
  static const SiftSums& of(Instructions instructions);

  /// out[x] = sum over i < pairs of weights[i] * (rows[-i][x] + rows[i + shift][x]) for x in [begin, end),
  /// whole blocks of kPlaneBlock.
  void (*rows)(const float* const* rows, int shift, const float* weights, int pairs, int begin, int end,
               float* out);
  /// As rows with shift 0, for a row and the one below it: each row of the input is read once for both.
  void (*two_rows)(const float* const* rows, const float* weights, int pairs, int begin, int end, float* out,
                   float* out_below);
  /// out[x] = sum over i < pairs of weights[i] * (row[x - i] + row[x + i + shift]) for x in [0, width), whole
  /// blocks. Reads from row[-kSumsMargin] on, and kSumsMargin or pairs + shift behind the width.
  void (*samples)(const float* row, int shift, const float* weights, int pairs, int width, float* out);
};

constexpr int kSumsMargin = 16;  // floats, or as many as the kernel has pairs

}  // namespace mono_pose_tracker
