#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <string>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"

namespace mono_pose_tracker {

struct ConvertedCamera {
  CameraParameters parameters;  // of the image as it is sent: binning and region of interest are applied
  Reason reason = Reason::kOk;
  std::string error;  // one line that says what to do, when reason is not kOk
  CalibrationSource source = CalibrationSource::kGiven;
  std::string size_origin = "";  // how width and height came about: "width and height of camera_info, ..."
  std::string note = "";         // about ignored fields, one line; empty: none
  bool has_distortion = false;   // D of the message is not zero, whether it is used or not
};

/// K and D of the message; when the images are rectified P and no distortion. kUncalibrated when the matrix
/// is zero (what drivers send before calibration) or has skew, or the distortion is of no known model.
ConvertedCamera convert_camera_info(const sensor_msgs::CameraInfo& info, bool rectified);

/// The message that a driver of this camera would send, frame_id camera_optical, without a stamp.
sensor_msgs::CameraInfo to_camera_info(const CameraParameters& camera);

/// The path of a calibration file, which need not be there. url: a path, file://PATH or
/// package://PACKAGE/PATH. Throws std::runtime_error naming what is there in a file's place: a pipe would be
/// waited for without end.
std::string calibration_file(const std::string& url);

/// Reads a calibration file (YAML or INI, as camera_calibration writes it). url: as of calibration_file.
/// Throws std::runtime_error naming the file.
sensor_msgs::CameraInfo load_camera_info(const std::string& url);

}  // namespace mono_pose_tracker
