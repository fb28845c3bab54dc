#pragma once

#include <opencv2/core.hpp>

#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "segmentation/background_model.h"

namespace mono_pose_tracker {

// px of the reduced image. Opening removes specks of noise; closing bridges places where the object resembles
// the background.
constexpr int kOpeningRadius = 1;
constexpr int kClosingRadius = 4;
// px of the reduced image by which motion blur may extend the object.
constexpr int kUpdateRadius = 5;

/// The image at the working width, at most 320 px.
cv::Mat reduced(const cv::Mat& image);

/// A mask of a reduced image at full size.
cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size);

/// Pixels farther than radius [px] from the mask.
cv::Mat outside_of(const cv::Mat& mask, int radius);

/// CV_8UC1; the image itself where it is that.
cv::Mat gray_of(const cv::Mat& image);

BackgroundModelOptions model_options(const SegmentationOptions& options);

}  // namespace mono_pose_tracker
