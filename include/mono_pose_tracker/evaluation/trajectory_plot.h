#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "mono_pose_tracker/evaluation/trajectory_error.h"

namespace mono_pose_tracker {

/// Reference and aligned estimate from above and from the side (axes of the first reference camera: above
/// looks along its y axis, the side along its x axis), and the position error over time.
cv::Mat draw_trajectory_plot(const TrajectoryError& error);

/// Writes the picture in the format of the name's extension. Throws std::runtime_error naming the path when
/// it cannot.
void write_trajectory_plot(const std::string& path, const TrajectoryError& error);

}  // namespace mono_pose_tracker
