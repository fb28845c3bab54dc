#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "ros/camera_info_conversion.h"

namespace mono_pose_tracker {

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
