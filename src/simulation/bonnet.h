#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Draws what is fixed to the camera over the lower quarter of the image, arched, full of texture: a bonnet,
/// a dashboard, a handlebar. It shakes by up to two pixels either way (at 640 px width), another way with
/// each `frame`, or stays exactly in its place. `mask` is 0 where it covers a pixel's centre. `color`:
/// CV_32FC3, [0, 1]; `mask`: CV_8UC1.
void draw_bonnet(const CameraModel& camera, bool shakes, int frame, std::uint32_t seed, int threads,
                 cv::Mat* color, cv::Mat* mask);

}  // namespace mono_pose_tracker
