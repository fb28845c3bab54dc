#include "mono_pose_tracker/ros/bag_writer.h"

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <stdexcept>

#include "mono_pose_tracker/ros/camera_info_conversion.h"

namespace mono_pose_tracker {
namespace {

/// A bag refuses a record at time 0, which a header may well hold.
ros::Time record_time(const ros::Time& stamp) { return std::max(stamp, ros::TIME_MIN); }

}  // namespace

BagWriter::BagWriter(const std::string& path, const CameraParameters& camera)
    : path_(path), info_(to_camera_info(camera)) {
  try {
    bag_.open(path, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path + ": cannot be written (" + error.what() + ")");
  }
}

void BagWriter::write_image(const std::string& topic, std::int64_t stamp_ns, const cv::Mat& image) {
  namespace encodings = sensor_msgs::image_encodings;
  std_msgs::Header header;
  header.frame_id = info_.header.frame_id;
  header.stamp.fromNSec(stamp_ns);
  const cv_bridge::CvImage message(header, image.channels() == 1 ? encodings::MONO8 : encodings::BGR8, image);
  try {
    bag_.write(topic, record_time(header.stamp), *message.toImageMsg());
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path_ + ": cannot be written (" + error.what() + ")");
  }
}

void BagWriter::write(std::int64_t stamp_ns, const cv::Mat& image) {
  write_image("/camera/image_raw", stamp_ns, image);
  info_.header.stamp.fromNSec(stamp_ns);
  try {
    bag_.write("/camera/camera_info", record_time(info_.header.stamp), info_);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path_ + ": cannot be written (" + error.what() + ")");
  }
}

void BagWriter::write_mask(std::int64_t stamp_ns, const cv::Mat& mask) {
  write_image("/camera/mask", stamp_ns, mask);
}

void BagWriter::close() {
  try {
    bag_.close();
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path_ + ": cannot be written (" + error.what() + ")");
  }
}

}  // namespace mono_pose_tracker
