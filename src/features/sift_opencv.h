#pragma once

#include <memory>

#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

/// cv::SIFT with the interface of SiftExtractor. Its first octave is always -1; first_octave, min_features
/// and num_threads are ignored.
std::unique_ptr<FeatureExtractor> make_opencv_sift(const SiftOptions& options);

/// Whether this was built with an OpenCV that has it (4.4 or later).
bool has_opencv_sift();

}  // namespace mono_pose_tracker
