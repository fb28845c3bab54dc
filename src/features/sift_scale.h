#pragma once

#include <cmath>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

/// Where the search for features begins.
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
/// Octave: 0. (Small images are not doubled: what is small on them is mostly blocks of JPEG.)
///
/// Reduction: none for a recording, which waits, and finer features pose more accurately. Live, where each
/// frame must be done before the next one comes, an image of more than 2 x 640 x 480 px is reduced, by the
/// least whole number that leaves what one thread searches about as fast as one of 640 x 480: the other cores
/// may be busy with the map.
///
/// Sigma: 1.6 from octave -1 (Lowe: 0.8 px of the image), 1.2 from octave 0 (JPEG blocks show below), 1.0
/// from reduced and halved images, whose pixels are means already.
SiftScale choose_sift_scale(const SiftOptions& options, const cv::Size& image,
                            SearchPace pace = SearchPace::kRecording);

/// For an object that is small: its area's square root [px] is below kSmallObject of the pixels that are
/// searched.
bool is_small_object(double object_px, const SiftScale& scale);

/// An octave finer, or nearly: of a reduced image half the reduction, else the octave before, down to
/// kFinestOctave; with the sigma that goes with it.
SiftScale finer(const SiftScale& scale);

/// Threads to search an image with, where options leave that open. Live one for each 640 x 480 px that are
/// searched, or a quarter more (thirty that are only read and reduced count as one), on no more than `cores`;
/// a recording's images go side by side, on one each.
int choose_sift_threads(const SiftOptions& options, const SiftScale& scale, const cv::Size& image,
                        SearchPace pace, int cores);

/// Input px in one px of the finest features that are searched for, at least 1: what thresholds in px that
/// stand for the features' noise are to be multiplied with.
double feature_pixel_size(const SiftScale& scale);

}  // namespace mono_pose_tracker
