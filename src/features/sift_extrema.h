#pragma once

#include <vector>

#include "mono_pose_tracker/features/sift.h"
#include "sift_scale_space.h"

namespace mono_pose_tracker {

/// An extremum of the difference of Gaussians. Its orientation is not yet known.
struct Extremum {
  int octave = 0;
  int level = 0;    // the Gaussian image nearest in scale
  float x = 0;      // px of the octave
  float y = 0;      // px of the octave
  float sigma = 0;  // px of the octave
  Feature feature;  // the same in px of the input, without angle
};

/// Lowe (2004), sections 3.1 and 4: extrema among 26 neighbours, refined by a quadratic in x, y and scale,
/// those of low contrast and on edges left out.
class ExtremaFinder {
 public:
  explicit ExtremaFinder(const SiftOptions& options) : options_(options), parts_(options.num_threads) {}

  /// The order depends on the images alone.
  void find(const ScaleSpace& space, float contrast_threshold, std::vector<Extremum>* extrema);

 private:
  struct Part {
    std::vector<float> differences;  // three rows of each difference image, a ring
    std::vector<int> candidates;
    std::vector<Extremum> extrema;
  };

  void find_in_rows(const ScaleSpace& space, float contrast_threshold, int octave, int begin, int end,
                    Part* part) const;

  SiftOptions options_;
  std::vector<Part> parts_;
};

}  // namespace mono_pose_tracker
