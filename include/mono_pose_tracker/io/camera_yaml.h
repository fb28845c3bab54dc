#pragma once

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

struct CalibrationFile {
  CameraParameters camera;
  bool has_distortion = false;  // a coefficient is not zero, whether it is used or not
  std::string note;             // about ignored entries, one line; empty: none
};

/// Reads the YAML that ROS camera_calibration writes. The result is valid for CameraModel; rectified: the
/// camera of the images that image_proc makes (projection_matrix, no distortion). Throws std::runtime_error,
/// one line naming the file, the key, its value and what was expected.
CalibrationFile read_calibration_yaml(const std::string& path, bool rectified);

/// Throws as read_calibration_yaml where a key is missing or is not what camera_calibration writes for it.
/// Does not ask whether the values are those of a camera.
void require_calibration_keys(const std::string& path);

/// The camera of the raw images.
inline CameraParameters read_camera_yaml(const std::string& path) {
  return read_calibration_yaml(path, false).camera;
}

/// Writes the same layout (rectification identity, projection the camera matrix). Throws std::runtime_error
/// naming the path when it cannot be written.
void write_camera_yaml(const std::string& path, const std::string& camera_name,
                       const CameraParameters& parameters);

}  // namespace mono_pose_tracker
