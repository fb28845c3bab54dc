#pragma once

#include <opencv2/core.hpp>

#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "segmentation/background_model.h"

namespace mono_pose_tracker {

// px of the reduced image. Specks of noise are smaller than the opening; the closing bridges places where the
// object looks like what is behind it.
constexpr int kOpeningRadius = 1;
constexpr int kClosingRadius = 4;
// px of the reduced image that the object may have blurred into.
constexpr int kUpdateRadius = 5;

/// The image at the width that is worked at, 320 px or less.
cv::Mat reduced(const cv::Mat& image);

/// A mask of a reduced image at full size.
cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size);

/// Where a mask is surely 0: what is not within radius px of it.
cv::Mat outside_of(const cv::Mat& mask, int radius);

/// CV_8UC1; the image itself where it is that.
cv::Mat gray_of(const cv::Mat& image);

BackgroundModelOptions model_options(const SegmentationOptions& options);

}  // namespace mono_pose_tracker
