#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Draws a hand that comes in from the lower right, wipes over the middle and leaves again while `done`, the
/// share of the sequence that has passed, goes from 0.25 to 0.75. It moves on its own, so `mask` is 0 where
/// it covers a pixel's centre. `color`: CV_32FC3, [0, 1]; `mask`: CV_8UC1.
void draw_hand(const CameraModel& camera, double done, std::uint32_t seed, int threads, cv::Mat* color,
               cv::Mat* mask);

}  // namespace mono_pose_tracker
