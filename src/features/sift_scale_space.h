#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "features/sift_scale.h"
#include "mono_pose_tracker/features/sift.h"
#include "sift_gaussian.h"
#include "sift_plane.h"

namespace mono_pose_tracker {

/// Lowe (2004), section 3: octaves of octave_layers + 3 images, level s blurred to sigma * 2^(s /
/// octave_layers) px of its octave, counted from the image as it comes. (Lowe takes that to be blurred by 0.5
/// px already; on the sequences we measured, key points repeat better without.) Grey values are in [0, 1].
/// Pixel (0, 0) of every octave lies on pixel (0, 0) of the input.
class ScaleSpace {
 public:
  ScaleSpace(const SiftOptions& options, const SiftScale& scale);

  const SiftScale& scale() const { return scale_; }

  /// Called when rows [begin, end) of all images of an octave have been made, in order.
  using RowsMade = std::function<void(int octave, int begin, int end)>;

  /// Octaves end where the shorter side would have fewer than kSmallestOctave px. rows_made is called a few
  /// rows at a time, while they are still in the cache.
  void build(const cv::Mat& gray, const RowsMade& rows_made);

  int octaves() const { return octaves_; }
  int layers() const { return options_.octave_layers; }
  const Plane& gaussian(int octave, int level) const { return planes_[octave * (layers() + 3) + level]; }
  /// Input px in one px of the octave.
  float pixel_size(int octave) const;
  /// Gaussian sigma, in px of the octave, of a level that need not be whole.
  float sigma_of_level(float level) const;

 private:
  void build_base(const cv::Mat& gray);
  void build_doubled_base(Plane* base);
  void reduce_input(const PairKernel& kernel, int step);
  void blur(const Plane& in, const PairKernel& kernel, int row_step, Plane* out);
  void blur_rows(const Plane& in, const PairKernel& kernel, int row_step, int begin, int end, Plane* out);
  bool make_levels(int octave, const RowsMade& rows_made);

  static constexpr int kSmallestOctave = 12;  // px; extrema keep 5 px off the border
  // Rows of all levels, with the reach of the kernels, fill a second-level cache. Threads wait for each other
  // at each step and level, so with several threads the steps are longer.
  static constexpr int kRowsOfOneThread = 16;
  static constexpr int kRowsOfEachThread = 64;

  SiftOptions options_;
  SiftScale scale_;
  int octaves_ = 0;
  std::vector<PairKernel> level_kernels_;  // [s - 1] takes level s - 1 to level s
  PairKernel base_kernel_;                 // input, or what is left of it after reductions, to base
  PairKernel base_kernel_between_;         // the same half a pixel further
  std::vector<std::pair<PairKernel, int>> reductions_;  // one after the other: blur, and px that become one
  Plane input_;
  Plane smoothed_;
  std::vector<Plane> planes_;
  std::vector<int> made_;            // rows of each level of the octave that is being made
  std::vector<BandFilter> filters_;  // one a thread
};

}  // namespace mono_pose_tracker
