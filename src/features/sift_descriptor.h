#pragma once

#include "sift_normalisation.h"
#include "sift_plane.h"

namespace mono_pose_tracker {

/// Lowe (2004), section 6: 4 x 4 histograms of 8 directions each around (x, y) in a Gaussian image of about
/// `sigma` px turned by `angle`; histogram[(4 * row + column) * 8 + direction], of length 1 before and after
/// entries were limited to 0.2 (0 where the image is flat).
void compute_histogram(const Plane& gaussian, float x, float y, float sigma, float angle,
                       float histogram[kDescriptorSize]);

}  // namespace mono_pose_tracker
