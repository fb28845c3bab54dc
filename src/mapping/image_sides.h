#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Whether the first of two point sets reaches more of the image's four sides (an eighth of the image each)
/// than the second. A background reaches the sides around the object in front of it; a view reaches them
/// around ego-vehicle features.
bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera);

}  // namespace mono_pose_tracker
