#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mono_pose_tracker {

// Messages of ROS 2 in CDR. `stamp_ns` is header.stamp, which may be negative there; the header of the
// message of ROS 1 stays empty but for its frame_id. Each throws std::runtime_error, one line, when the bytes
// are none.

/// sensor_msgs/msg/Image.
sensor_msgs::ImagePtr read_ros2_image(std::string_view cdr, std::int64_t* stamp_ns);

/// sensor_msgs/msg/CompressedImage: the bytes of the image file. format: what the message states; null: not
/// wanted.
std::vector<unsigned char> read_ros2_compressed_image(std::string_view cdr, std::int64_t* stamp_ns,
                                                      std::string* format = nullptr);

/// sensor_msgs/msg/CameraInfo.
sensor_msgs::CameraInfo read_ros2_camera_info(std::string_view cdr, std::int64_t* stamp_ns);

}  // namespace mono_pose_tracker
