#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/sequence_options.h"

namespace mono_pose_tracker {

/// Background of a head that is static in the image (CV_32FC3, blue green red, [0, 1]): a dark cloth,
/// texture, or a bright wall. For a room: the dark cloth.
cv::Mat static_background(const CameraModel& camera, BackgroundKind kind, std::uint32_t seed, int threads);

}  // namespace mono_pose_tracker
