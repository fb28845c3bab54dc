#pragma once

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Reads the YAML that ROS camera_calibration writes. What it returns makes a CameraModel. Throws
/// std::runtime_error, one line naming the file, the key, its value and what was expected.
CameraParameters read_camera_yaml(const std::string& path);

/// Writes the same layout (rectification identity, projection the camera matrix). Throws std::runtime_error
/// naming the path when it cannot be written.
void write_camera_yaml(const std::string& path, const std::string& camera_name,
                       const CameraParameters& parameters);

}  // namespace mono_pose_tracker
