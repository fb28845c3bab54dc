#pragma once

#include <opencv2/core.hpp>

#include "mono_pose_tracker/segmentation/segmentation_options.h"

namespace mono_pose_tracker {

/// Reads segmentation/background_image (CV_8UC3) where the method is `background` and an image is named;
/// otherwise returns an empty one. Throws std::invalid_argument, one line with the option, the path and the
/// reason, when the image cannot be read completely.
cv::Mat read_background_image(const SegmentationOptions& options);

}  // namespace mono_pose_tracker
