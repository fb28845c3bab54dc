#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Writes images with their calibration as a camera driver would have them recorded: sensor_msgs/Image on
/// /camera/image_raw, sensor_msgs/CameraInfo on /camera/camera_info, frame_id camera_optical, one stamp for
/// both.
class BagWriter {
 public:
  /// Throws std::runtime_error naming the path when it cannot be written.
  BagWriter(const std::string& path, const CameraParameters& camera);

  /// `image`: CV_8UC3 (blue green red) or CV_8UC1. Throws std::runtime_error naming the path.
  void write(std::int64_t stamp_ns, const cv::Mat& image);

  /// `mask`: CV_8UC1, 0 = ignore; on /camera/mask.
  void write_mask(std::int64_t stamp_ns, const cv::Mat& mask);

  /// Without it the bag lacks its index until destruction. Throws std::runtime_error naming the path.
  void close();

 private:
  void write_image(const std::string& topic, std::int64_t stamp_ns, const cv::Mat& image);

  std::string path_;
  rosbag::Bag bag_;
  sensor_msgs::CameraInfo info_;
};

}  // namespace mono_pose_tracker
