#pragma once

#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// The image with what became of it in words, and the map's points where the pose sees them. image: CV_8UC1
/// or CV_8UC3 (BGR). Returns CV_8UC3 (BGR) of the same size.
cv::Mat draw_debug_image(const cv::Mat& image, const FrameReport& report, const CameraModel& camera,
                         const MapSnapshot& map);

}  // namespace mono_pose_tracker
