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

/// Limits of the search for extrema.
struct ExtremaOptions {
  int border = 5;     // px of an octave: nearer to the border, mirrored pixels shape the extremum
  int max_steps = 5;  // of the refinement, a pixel or a level each; more are rare and end on edges
  // px and levels: with a larger offset a neighbour is the nearer sample. A little more than half, so that an
  // extremum between two samples does not alternate between them.
  float max_offset = 0.6F;
  float sample_contrast_share = 0.5F;  // of the contrast threshold, for a sample before its refinement
};

/// Lowe (2004), sections 3.1 and 4: extrema among 26 neighbours, refined by a quadratic in x, y and scale,
/// excluding those of low contrast and on edges. The order depends on the images alone.
class ExtremaFinder {
 public:
  explicit ExtremaFinder(const SiftOptions& options, const ExtremaOptions& limits = {})
      : options_(options), limits_(limits), parts_(options.num_threads) {}

  /// Forgets what was found. Of what is looked at from here on, samples of at least this contrast are kept.
  void begin(float contrast_threshold);
  float contrast_threshold() const { return contrast_threshold_; }
  /// Finds the samples of rows [begin, end) of an octave that exceed their neighbours, after those before
  /// them. Later rows need not be there.
  void look_at(const ScaleSpace& space, int octave, int begin, int end);
  /// Of the samples found, once the octaves are whole: no lower threshold than they were found with.
  void refine(const ScaleSpace& space, float contrast_threshold, std::vector<Extremum>* extrema);

 private:
  struct Sample {
    int octave;
    int level;
    int x;
    int y;
    float contrast;  // difference of Gaussians, positive
  };
  struct Part {
    std::vector<float> differences;  // three rows of each difference image, a ring
    std::vector<int> candidates;
    std::vector<Sample> samples;
    std::vector<Extremum> extrema;
  };

  float sample_threshold(float contrast_threshold) const;
  void look_at_rows(const ScaleSpace& space, int octave, int begin, int end, Part* part) const;

  SiftOptions options_;
  ExtremaOptions limits_;
  float contrast_threshold_ = 0;
  std::vector<Sample> samples_;
  std::vector<Part> parts_;
};

}  // namespace mono_pose_tracker
