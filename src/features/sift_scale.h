#pragma once

#include <cmath>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

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
                            SearchPace pace = SearchPace::kRecording);

/// Whether an object is small: the square root of its area [px] is below kSmallObject of the searched pixels.
bool is_small_object(double object_px, const SiftScale& scale);

/// Next finer octave: for a reduced image half the reduction, else the octave before, down to kFinestOctave;
/// with the corresponding sigma.
SiftScale finer(const SiftScale& scale);

/// Number of threads for an image, if options leave it open. Live: one per 640 x 480 searched px, with a
/// tolerance of a quarter (thirty px that are only read and reduced count as one), at most `cores`. The
/// images of a recording are processed in parallel, with one thread each.
int choose_sift_threads(const SiftOptions& options, const SiftScale& scale, const cv::Size& image,
                        SearchPace pace, int cores);

/// Input px per px of the finest features, at least 1: factor for thresholds in px that represent the
/// localisation noise of features.
double feature_pixel_size(const SiftScale& scale);

}  // namespace mono_pose_tracker
