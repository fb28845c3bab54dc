#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

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

/// Values of the setting `camera_info_source`, the default first.
inline const std::vector<std::string> kCameraInfoSources = {"auto", "topic", "file"};

/// The calibration to use. auto: that of the newest camera_info; before the first one, or if it is not
/// calibrated, that of a given file. topic, file: that one only. Otherwise a guess, if a field of view was
/// given. May be called from any thread.
class CameraSource {
 public:
  /// hfov_deg: of the guess, see guess_camera; 0: none is made. source: one of kCameraInfoSources.
  explicit CameraSource(bool rectified, double hfov_deg = 0, const std::string& source = "auto")
      : rectified_(rectified),
        uses_topic_(source != "file"),
        uses_file_(source != "topic"),
        hfov_deg_(hfov_deg) {}

  void set_file(const sensor_msgs::CameraInfo& info);
  void set_message(const sensor_msgs::CameraInfoConstPtr& info);

  /// A guess needs the size of the images.
  void set_image_size(int width, int height);

  bool has_calibration() const;
  bool is_calibrated_by_message() const;  // whatever else there is, then
  bool may_guess() const { return hfov_deg_ > 0; }

  /// The calibration; waits for the first camera_info at most this long (a driver sends it just after its
  /// image).
  std::optional<ConvertedCamera> wait(std::chrono::milliseconds timeout) const;

 private:
  const bool rectified_, uses_topic_, uses_file_;
  const double hfov_deg_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::condition_variable arrived_;
  std::optional<ConvertedCamera> file_, message_, guess_;

  // The lock being held.
  bool has_calibrated_message() const;
  std::optional<ConvertedCamera> camera() const;
};

}  // namespace mono_pose_tracker
