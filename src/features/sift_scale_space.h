#pragma once

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <utility>
#include <vector>

#include "mono_pose_tracker/features/sift.h"
#include "sift_gaussian.h"
#include "sift_plane.h"

namespace mono_pose_tracker {

/// Splits [0, size) into `threads` even parts and calls function(part, begin, end) for each, at most
/// `threads` at once (on OpenCV's pool, which cv::setNumThreads limits as well).
template <typename Function>
void for_parts(int size, int threads, const Function& function) {
  const auto begin_of = [&](int part) {
    return static_cast<int>(static_cast<long long>(size) * part / threads);
  };
  if (threads == 1) {
    function(0, 0, size);
    return;
  }
  cv::parallel_for_(
      cv::Range(0, threads),
      [&](const cv::Range& parts) {
        for (int part = parts.start; part < parts.end; ++part)
          function(part, begin_of(part), begin_of(part + 1));
      },
      threads);
}

/// Start of the search for features.
struct SiftScale {
  int first_octave = 0;  // -1: the image is doubled first; 0; 1: halved; 2: halved twice
  float sigma = 1.2f;    // blur of the first octave's base, px of that octave
  int reduction = 1;     // px of the image, either way, that become one before that

  /// Input px in one px of the first octave.
  double pixel_size() const { return reduction * std::exp2(first_octave); }

  bool operator==(const SiftScale& o) const {
    return first_octave == o.first_octave && sigma == o.sigma && reduction == o.reduction;
  }
  bool operator!=(const SiftScale& o) const { return !(*this == o); }
};

/// How much of a live image is searched, and by how many threads.
struct LiveSearchOptions {
  // px that are searched at most. SIFT's time grows with them and leaves a frame of 33 ms on two cores the
  // time for the rest up to twice the size that most cameras are sold for (640x480).
  double most_pixels = 2 * 640 * 480;
  double pixels_of_a_thread = 1.25 * 640 * 480;  // that it searches: 640x480, and cameras with a little more
  double read_in_time_of_search = 30;  // px that are read and reduced in the time that it takes to search one
};

/// The octave, reduction and sigma that options leave open (explicit values win).
///
/// Octave: 0. (Small images are not doubled: their small structures are mostly blocks of JPEG.)
///
/// Reduction: none for a recording, because finer features give more accurate poses. A live image of more
/// than 2 x 640 x 480 px is reduced by the smallest integer with which one thread searches it about as fast
/// as one of 640 x 480: the other cores may be busy with the map.
///
/// Sigma: 1.6 from octave -1 (Lowe: 0.8 px of the image), 1.2 from octave 0 (JPEG blocks show below), 1.0
/// from reduced and halved images, whose pixels are means already.
SiftScale choose_sift_scale(const SiftOptions& options, const cv::Size& image,
                            SearchPace pace = SearchPace::kRecording, const LiveSearchOptions& live = {});

/// Whether an object is small: the square root of its area [px] is below kSmallObject of the searched pixels.
bool is_small_object(double object_px, const SiftScale& scale);

/// Next finer octave: for a reduced image half the reduction, else the octave before, down to kFinestOctave;
/// with the corresponding sigma.
SiftScale finer(const SiftScale& scale);

/// Number of threads for an image, if options leave it open. Live: one per 640 x 480 searched px, with a
/// tolerance of a quarter (thirty px that are only read and reduced count as one), at most `cores`. The
/// images of a recording are processed in parallel, with one thread each.
int choose_sift_threads(const SiftOptions& options, const SiftScale& scale, const cv::Size& image,
                        SearchPace pace, int cores, const LiveSearchOptions& live = {});

/// Input px per px of the finest features, at least 1: factor for thresholds in px that represent the
/// localisation noise of features.
double feature_pixel_size(const SiftScale& scale);

struct ScaleSpaceOptions {
  int smallest_octave = 12;    // px of the shorter side; extrema keep 5 px off the border
  float reduced_sigma = 0.8F;  // px of the result: blurred to this an image can be reduced
  // Rows of all levels, with the reach of the kernels, fill a second-level cache. Threads wait for each other
  // at each step and level, so with several threads the steps are longer.
  int rows_of_one_thread = 16, rows_of_each_thread = 64;
};

/// Lowe (2004), section 3: octaves of octave_layers + 3 images, level s blurred to sigma * 2^(s /
/// octave_layers) px of its octave, counted from the image as it comes. (Lowe takes that to be blurred by 0.5
/// px already; on the sequences we measured, key points repeat better without.) Grey values are in [0, 1].
/// Pixel (0, 0) of every octave lies on pixel (0, 0) of the input.
class ScaleSpace {
 public:
  ScaleSpace(const SiftOptions& options, const SiftScale& scale, const ScaleSpaceOptions& limits = {});

  const SiftScale& scale() const { return scale_; }
  /// Of the images to come. Their planes take the memory of those before: given back and asked for again, it
  /// would be split by what is kept for long.
  void set_scale(const SiftScale& scale);

  /// Called when rows [begin, end) of all images of an octave have been made, in order.
  using RowsMade = std::function<void(int octave, int begin, int end)>;

  /// Octaves end where the shorter side would have fewer than smallest_octave px. rows_made is called a few
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

  SiftOptions options_;
  ScaleSpaceOptions limits_;
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
