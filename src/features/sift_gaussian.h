#pragma once

#include <cstddef>
#include <vector>

#include "sift_plane.h"

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

/// A symmetric kernel as weights of pairs. Centred on a sample, pair i is (x - i, x + i), where pair 0 counts
/// its sample twice and has half its weight; centred between two, pair i is (x - i, x + 1 + i). The weights
/// sum to 1/2.
struct PairKernel {
  std::vector<float> weights;
  bool between_samples = false;

  /// Of the second sample of each pair, beyond the first's mirror image.
  int shift() const { return between_samples ? 1 : 0; }
  int reach() const {
    return static_cast<int>(weights.size());
  }  // samples needed on either side, or one more
};

/// sigma in samples. reach_in_sigmas: the part of a Gaussian beyond 4 (6e-5) is below the noise of 8-bit
/// images.
PairKernel gaussian_kernel(float sigma, bool between_samples = false, float reach_in_sigmas = 4);

/// Separable filters, border mirrored. Each thread has its own.
class BandFilter {
 public:
  /// Rows [begin, end) of the output: row y is row y * row_step of the input filtered with `kernel` along y
  /// and x.
  void filter(const Plane& in, const PairKernel& kernel, int row_step, int begin, int end, Plane* out);

  /// As filter, at twice the samples along x and y: by the kernels on and between samples.
  void filter_doubled(const Plane& in, const PairKernel& on_samples, const PairKernel& between_samples,
                      int begin, int end, Plane* out);

 private:
  /// A row of the input on which, or half a row below which, a row of the output lies.
  struct Centre {
    int row;
    const PairKernel* vertical;
  };

  void filter_vertically(const Plane& in, const Centre* centres, int count, int margin);
  void sum_vertically(const Centre* centres, int count, int first, int begin, int end);
  void filter_along_row(int i, const PairKernel& kernel, int width, float* out);
  float* band_row(int i) { return band_.data() + static_cast<std::size_t>(band_stride_) * i + margin_; }

  const SiftSums& sums_ = SiftSums::of(SiftSums::best_instructions());
  std::vector<Centre> centres_;
  std::vector<const float*> rows_;  // of the input, mirrored beyond its border
  std::vector<float> band_;         // rows filtered along y, with a margin on either side
  int band_stride_ = 0;
  int margin_ = 0;
  std::vector<float> even_;
  std::vector<float> odd_;
};

}  // namespace mono_pose_tracker
