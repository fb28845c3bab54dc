#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// When two halves of an image are taken for the images of a stereo camera.
struct StereoPairOptions {
  /// Least correlation of the halves at their best shift, 0 to 1. Simulated pairs with a baseline of 12 cm
  /// have 0.75 or more, other images 0.22 or less (13 sequences).
  double min_correlation = 0.5;
  /// Largest disparity, as a share of the width of a half.
  double max_disparity = 0.15;
  /// Least ratio of the image's sides, longer over shorter: the halves of two images of 1:1 side by side. A
  /// repeated pattern may correlate as well in other images.
  double min_aspect = 1.9;
  int min_side = 32;  // px of a half; smaller ones are not compared
  /// The halves are compared at this width [px], and at least this height.
  int compared_width = 160, min_compared_height = 24;
  /// px of the reduced half: Gaussian sigma of the part that is subtracted, as exposure and shading are
  /// similar in any two halves.
  double slow_sigma = 6;
  int max_row_shift = 2;  // px of the reduced half: the two cameras are not aligned perfectly
};

/// A warning where the image looks like a stereo pair, side by side or one above the other; else empty.
std::string stereo_pair_text(const cv::Mat& image, const StereoPairOptions& options = {});

}  // namespace mono_pose_tracker
