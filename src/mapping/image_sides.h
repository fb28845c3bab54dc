#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Of two things that are seen at these pixels: whether the first holds more of the image's four sides (an
/// eighth of it each) than the second. A background reaches the sides beside the object that is before it; a
/// view reaches them beside what is fixed to the camera.
bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera);

}  // namespace mono_pose_tracker
