#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Throws std::runtime_error, one line that begins with `of_what`, when a message's stamp cannot hold the
/// time: before 0, or beyond 32 bits of seconds.
void require_message_stamp(const std::string& of_what, std::int64_t stamp_ns);

/// Writes images with their calibration as a camera driver would have them recorded: sensor_msgs/Image on
/// /camera/image_raw, sensor_msgs/CameraInfo on /camera/camera_info, frame_id camera_optical, one stamp for
/// both.
class BagWriter {
 public:
  /// camera: none: no CameraInfo is written. jpeg_quality: 1 to 100: sensor_msgs/CompressedImage on
  /// /camera/image_raw/compressed instead; 0: raw. Throws std::runtime_error naming the path when it cannot
  /// be written.
  BagWriter(const std::string& path, const std::optional<CameraParameters>& camera, int jpeg_quality = 0);

  /// `image`: CV_8UC3 (blue green red) or CV_8UC1. Throws std::runtime_error naming the path.
  void write(std::int64_t stamp_ns, const cv::Mat& image);

  /// `mask`: CV_8UC1, 0 = ignore; on /camera/mask.
  void write_mask(std::int64_t stamp_ns, const cv::Mat& mask);

  /// Without it the bag lacks its index until destruction. Throws std::runtime_error naming the path.
  void close();

 private:
  /// Leaves a bag that cannot be closed where it is.
  struct EndBag {
    void operator()(rosbag::Bag* bag) const;
  };
  template <typename Message>
  void write_message(const std::string& topic, const Message& message);
  void write_raw(const std::string& topic, std::int64_t stamp_ns, const cv::Mat& image);
  void write_jpeg(std::int64_t stamp_ns, const cv::Mat& image);

  const std::string path_;
  const int jpeg_quality_;
  std::unique_ptr<rosbag::Bag, EndBag> bag_;
  std::optional<sensor_msgs::CameraInfo> info_;
};

}  // namespace mono_pose_tracker
