#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "mono_pose_tracker/evaluation/trajectory_error.h"

namespace mono_pose_tracker {

/// Reference and aligned estimate from above and from the side (up is what the reference's cameras have up on
/// average, forward where the first of them looks), and the errors of position and rotation over time.
cv::Mat draw_trajectory_plot(const TrajectoryError& error);

/// Writes the picture in the format of the name's extension. Throws std::runtime_error naming the path when
/// it cannot.
void write_trajectory_plot(const std::string& path, const TrajectoryError& error);

}  // namespace mono_pose_tracker
