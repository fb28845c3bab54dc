#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {

/// Background of a head that is static in the image (CV_32FC3, blue green red, [0, 1]): a dark cloth,
/// texture, or a bright wall. For a room: the dark cloth.
cv::Mat static_background(const CameraModel& camera, BackgroundKind kind, std::uint32_t seed, int threads);

/// Draws what is fixed to the camera over the lower quarter of the image, arched, full of texture: a bonnet,
/// a dashboard, a handlebar. It shakes by up to two pixels either way (at 640 px width), another way with
/// each `frame`, or stays exactly in its place. `mask` is 0 where it covers a pixel's centre. `color`:
/// CV_32FC3, [0, 1]; `mask`: CV_8UC1.
void draw_bonnet(const CameraModel& camera, bool shakes, int frame, std::uint32_t seed, int threads,
                 cv::Mat* color, cv::Mat* mask);

/// Draws a hand that comes in from the lower right, wipes over the middle and leaves again while `done`, the
/// share of the sequence that has passed, goes from 0.25 to 0.75. It moves on its own, so `mask` is 0 where
/// it covers a pixel's centre. `color`: CV_32FC3, [0, 1]; `mask`: CV_8UC1.
void draw_hand(const CameraModel& camera, double done, std::uint32_t seed, int threads, cv::Mat* color,
               cv::Mat* mask);

}  // namespace mono_pose_tracker
