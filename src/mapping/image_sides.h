#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// A point set reaches a side of the image that has enough of its points there, and more than of the other
/// set.
struct ImageSidesOptions {
  double side = 1.0 / 8;  // share of the image's width or height
  int min_features = 3;   // at a side
};

/// Whether the first of two point sets reaches more of the image's four sides (an eighth of the image each)
/// than the second. A background reaches the sides around the object in front of it; a view reaches them
/// around ego-vehicle features.
bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera, const ImageSidesOptions& options = {});

}  // namespace mono_pose_tracker
