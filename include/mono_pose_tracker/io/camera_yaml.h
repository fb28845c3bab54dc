#pragma once

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

struct CalibrationFile {
  CameraParameters camera;
  bool has_distortion = false;  // a coefficient is not zero, whether it is used or not
  std::string note;             // what was left out of it, one line; empty: nothing
};

/// Reads the YAML that ROS camera_calibration writes. The camera makes a CameraModel; rectified: that of the
/// images which image_proc makes (projection_matrix, no distortion). Throws std::runtime_error, one line
/// naming the file, the key, its value and what was expected.
CalibrationFile read_calibration_yaml(const std::string& path, bool rectified);

/// The camera of images as they are taken.
inline CameraParameters read_camera_yaml(const std::string& path) {
  return read_calibration_yaml(path, false).camera;
}

/// Writes the same layout (rectification identity, projection the camera matrix). Throws std::runtime_error
/// naming the path when it cannot be written.
void write_camera_yaml(const std::string& path, const std::string& camera_name,
                       const CameraParameters& parameters);

}  // namespace mono_pose_tracker
