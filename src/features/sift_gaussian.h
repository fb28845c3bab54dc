#pragma once

#include <vector>

#include "sift_plane.h"

namespace mono_pose_tracker {

/// A symmetric kernel as weights of pairs. Centred on a sample, pair i is (x - i, x + i), where pair 0 counts
/// its sample twice and has half its weight; centred between two, pair i is (x - i, x + 1 + i). The weights
/// sum to 1/2.
struct PairKernel {
  std::vector<float> weights;
  bool between_samples = false;

  int reach() const {
    return static_cast<int>(weights.size());
  }  // samples needed on either side, or one more
};

/// sigma in samples.
PairKernel gaussian_kernel(float sigma, bool between_samples = false);

/// Separable filters, border mirrored. Each thread has its own.
class RowFilter {
 public:
  /// Row y of the input filtered with `vertical` along y and `horizontal` along x; out holds in.stride()
  /// floats.
  void filter(const Plane& in, int y, const PairKernel& vertical, const PairKernel& horizontal, float* out);

  /// As filter, at twice the samples along x: out[2x] and out[2x + 1] by the kernels on and between samples.
  void filter_doubled(const Plane& in, int y, const PairKernel& vertical, const PairKernel& on_samples,
                      const PairKernel& between_samples, int out_width, float* out);

 private:
  void filter_vertically(const Plane& in, int y, const PairKernel& kernel, int margin);
  void filter_horizontally(const PairKernel& kernel, int stride, float* out);

  std::vector<const float*> before_;
  std::vector<const float*> after_;
  std::vector<float> padded_row_;
  std::vector<float> even_;
  std::vector<float> odd_;
  int margin_ = 0;
};

}  // namespace mono_pose_tracker
