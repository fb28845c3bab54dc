#pragma once

#include <array>
#include <cstdint>

#include "sift_plane.h"

namespace mono_pose_tracker {

constexpr int kMaxOrientations =
    4;  // of one extremum; more peaks within 80 % of the highest mean no direction at all

/// Window of the gradients around a key point, and the peaks among their directions.
struct OrientationOptions {
  float window_in_sigmas = 1.5F;  // sigma of the weights, in sigmas of the key point
  float reach_in_windows = 3;     // in sigmas of the weights
  float peak_share = 0.8F;        // of the highest peak: lower ones are no orientation of their own
};

/// Lowe (2004), section 5: the directions of the gradient around (x, y) in a Gaussian image of about `sigma`
/// px. Writes angles in rad in [0, 2 pi), x towards y; returns how many.
int find_orientations(const Plane& gaussian, float x, float y, float sigma,
                      std::array<float, kMaxOrientations>* angles, const OrientationOptions& options = {});

constexpr int kDescriptorSize = 128;

/// Scales to unit length, cuts entries at largest_entry (Lowe, section 6.1), scales again. 0 stays 0.
void limit_entries(float largest_entry, float* histogram);

/// A descriptor of any positive scale to bytes. root_sift: sqrt(d / sum(d)), the Hellinger kernel of
/// Arandjelovic and Zisserman (2012); else d / |d|. Either has unit length and is stored times 512, at most
/// 255 (as in Lowe's files).
void quantise_descriptor(const float* histogram, bool root_sift, std::uint8_t* descriptor);

struct HistogramOptions {
  float cell_in_sigmas = 3;    // width of a cell (as in Lowe's program)
  float largest_entry = 0.2F;  // of a unit vector: limits strong gradients, which depend on the light
};

/// Lowe (2004), section 6: 4 x 4 histograms of 8 directions each around (x, y) in a Gaussian image of about
/// `sigma` px turned by `angle`; histogram[(4 * row + column) * 8 + direction], of length 1 before and after
/// entries were limited (0 where the image is flat).
void compute_histogram(const Plane& gaussian, float x, float y, float sigma, float angle,
                       float histogram[kDescriptorSize], const HistogramOptions& options = {});

}  // namespace mono_pose_tracker
