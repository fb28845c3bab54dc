#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "mono_pose_tracker/ros/camera_info_conversion.h"

namespace mono_pose_tracker {

/// The calibration to use: that of a file when one was given, else that of the newest camera_info. May be
/// called from any thread.
class CameraSource {
 public:
  explicit CameraSource(bool rectified) : rectified_(rectified) {}

  /// From now on the file's calibration counts, whatever camera_info says.
  void set_file(const sensor_msgs::CameraInfo& info);
  void set_message(const sensor_msgs::CameraInfoConstPtr& info);

  bool has_calibration() const;

  /// The calibration; waits for the first one at most this long (a driver sends it just after its image).
  std::optional<ConvertedCamera> wait(std::chrono::milliseconds timeout) const;

 private:
  const bool rectified_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::condition_variable arrived_;
  bool from_file_ = false;
  std::optional<ConvertedCamera> camera_;
};

}  // namespace mono_pose_tracker
