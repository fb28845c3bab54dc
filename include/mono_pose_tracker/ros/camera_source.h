#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "mono_pose_tracker/ros/camera_info_conversion.h"

namespace mono_pose_tracker {

/// The calibration to use: that of the newest camera_info; while none has come, or it is not calibrated, that
/// of a file when one was given. May be called from any thread.
class CameraSource {
 public:
  explicit CameraSource(bool rectified) : rectified_(rectified) {}

  void set_file(const sensor_msgs::CameraInfo& info);
  void set_message(const sensor_msgs::CameraInfoConstPtr& info);

  bool has_message() const;  // whether a camera_info has come, calibrated or not
  bool has_calibration() const;

  /// The calibration; waits for the first camera_info at most this long (a driver sends it just after its
  /// image).
  std::optional<ConvertedCamera> wait(std::chrono::milliseconds timeout) const;

 private:
  const bool rectified_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::condition_variable arrived_;
  std::optional<ConvertedCamera> file_, message_;

  std::optional<ConvertedCamera> camera() const;  // the lock being held
};

}  // namespace mono_pose_tracker
