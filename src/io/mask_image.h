#pragma once

#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// What an image says as a mask (CV_8UC1): 255 wherever any channel but transparency is not zero, which may
/// be the number of an object, however small and of however many bits. Where some of it is transparent, alpha
/// alone says: 0 = ignore.
cv::Mat mask_of_image(const cv::Mat& image);

}  // namespace mono_pose_tracker
